// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/report.h"

#include <nlohmann/json.hpp>
#include <variant>

#include "base/file.h"
#include "evaluation/statistics.h"

namespace photoslam {
namespace {

using Json = nlohmann::ordered_json;

template <class Visitor, class Ate>
void visit_ate(Visitor& v, const char* name, Ate& a) {
  v.group(name, [&](auto& g) {
    g("rmse_m", a.rmse_m), g("std_m", a.std_m), g("median_m", a.median_m), g("rot_rmse_deg", a.rot_rmse_deg);
    g("scale", a.scale), g("matched", a.matched);
  });
}

template <class Visitor, class Figures>
void visit_image(Visitor& v, const char* name, Figures& f) {
  v.group(name, [&](auto& g) {
    g("psnr_db", f.psnr_db), g("psnr_p5_db", f.psnr_p5_db), g("ssim", f.ssim), g("lpips", f.lpips);
    g("frames", f.frames);
  });
}

/// Names every key of report.json once, in order, for the writer and the reader.
template <class Visitor, class AnyReport>
void visit_keys(Visitor& v, AnyReport& r) {
  v.group("frames", [&](auto& g) {
    g("total", r.frames.total), g("tracked", r.frames.tracked), g("lost", r.frames.lost);
    g("lost_before_init", r.frames.lost_before_init), g("dropped", r.frames.dropped);
  });
  v.group("tracking", [&](auto& g) {
    auto& t = r.tracking;
    g("fps", t.fps), g("p50_ms", t.p50_ms), g("p99_ms", t.p99_ms), g("mean_ms", t.mean_ms), g("min_ms", t.min_ms);
    g("max_ms", t.max_ms), g("std_ms", t.std_ms), g("blocked_p99_ms", t.blocked_p99_ms);
    g("active_feature_ratio", t.active_feature_ratio);
  });
  v.group("latency", [&](auto& g) {
    g("p50_ms", r.latency.p50_ms), g("p99_ms", r.latency.p99_ms), g("max_ms", r.latency.max_ms);
  });
  v.group("mapping", [&](auto& g) {
    auto& m = r.mapping;
    g("iterations", m.iterations), g("ms_per_iteration", m.ms_per_iteration), g("gaussians", m.gaussians);
    g("keyframes", m.keyframes), g("keyframes_without_pictures", m.keyframes_without_pictures);
    g("cpu_seconds", m.cpu_seconds), g("seconds_online", m.seconds_online);
    g("seconds_drain", m.seconds_drain), g("seconds_refine", m.seconds_refine);
  });
  v("seconds_total", r.seconds_total);
  visit_ate(v, "ate", r.ate);
  visit_ate(v, "ate_online", r.ate_online);
  v.group("rpe", [&](auto& g) { g("trans_m", r.rpe.trans_m), g("rot_deg", r.rpe.rot_deg); });
  visit_image(v, "image_online", r.image_online);
  visit_image(v, "image", r.image);
  visit_image(v, "image_keyframes", r.image_keyframes);
  visit_image(v, "image_held_out", r.image_held_out);
  v.group("render", [&](auto& g) { g("fps", r.render.fps); });
  v.group("memory", [&](auto& g) { g("peak_rss_mb", r.memory.peak_rss_mb), g("gpu_mb", r.memory.gpu_mb); });
  v.group("gpu", [&](auto& g) { g("utilisation", r.gpu.utilisation); });
  v.group("map", [&](auto& g) { g("size_mb", r.map.size_mb); });
  v.group("loops", [&](auto& g) { g("closed", r.loops.closed), g("reconnected", r.loops.reconnected); });
  v("machine", r.machine);
  v("version", r.version);
  v.group("config", [&](auto& g) { g("all", r.config.all), g("changed", r.config.changed); });
}

class JsonWriter {
 public:
  template <class Visit>
  void group(const char* name, Visit visit) {
    JsonWriter inner;
    visit(inner);
    json_[name] = std::move(inner.json_);
  }
  template <class T>
  void operator()(const char* name, const std::optional<T>& value) {
    json_[name] = value ? Json(*value) : Json(nullptr);
  }
  void operator()(const char* name, const std::string& value) { json_[name] = value; }
  void operator()(const char* name, const std::vector<ConfigEntry>& entries) {
    Json object = Json::object();
    for (const auto& [key, value] : entries) std::visit([&, &k = key](const auto& v) { object[k] = v; }, value);
    json_[name] = std::move(object);
  }
  std::string text() const { return json_.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

 private:
  Json json_ = Json::object();
};

/// Takes what is there and has the right type.
class JsonReader {
 public:
  explicit JsonReader(const Json& json) : json_(json) {}

  template <class Visit>
  void group(const char* name, Visit visit) {
    JsonReader inner(find(name));
    visit(inner);
  }
  void operator()(const char* name, Figure& value) {
    const Json& json = find(name);
    value = json.is_number() ? Figure(json.get<double>()) : std::nullopt;
  }
  void operator()(const char* name, Count& value) {
    const Json& json = find(name);
    value = json.is_number_integer() ? Count(json.get<int64_t>()) : std::nullopt;
  }
  void operator()(const char* name, std::string& value) {
    const Json& json = find(name);
    value = json.is_string() ? json.get<std::string>() : "";
  }
  void operator()(const char* name, std::vector<ConfigEntry>& entries) {
    const Json& json = find(name);
    if (!json.is_object()) return;
    for (const auto& [key, value] : json.items()) {
      if (value.is_boolean()) entries.push_back({key, value.get<bool>()});
      if (value.is_number_integer()) entries.push_back({key, value.get<int>()});
      if (value.is_number_float()) entries.push_back({key, value.get<double>()});
      if (value.is_string()) entries.push_back({key, value.get<std::string>()});
    }
  }

 private:
  const Json& find(const char* name) const {
    static const Json kAbsent;
    const auto entry = json_.find(name);
    return entry == json_.end() ? kAbsent : *entry;
  }

  const Json& json_;
};

std::vector<double> collect(const FrameLog& log, std::optional<double> FrameRecord::* figure) {
  std::vector<double> values;
  for (const FrameRecord& record : log) {
    if (record.*figure) values.push_back(*(record.*figure));
  }
  return values;
}

void count_frames(const FrameLog& log, Report::Frames& frames) {
  int64_t tracked = 0, dropped = 0, lost = 0, lost_before_init = 0;
  for (const FrameRecord& record : log) {
    const bool is_lost = record.state != FrameState::tracked && record.state != FrameState::dropped;
    tracked += record.state == FrameState::tracked ? 1 : 0;
    dropped += record.state == FrameState::dropped ? 1 : 0;
    lost += is_lost ? 1 : 0;
    lost_before_init += is_lost && tracked == 0 ? 1 : 0;
  }
  frames = {static_cast<int64_t>(log.size()), tracked, lost, lost_before_init, dropped};
}

}  // namespace

void summarize(const FrameLog& log, Report& report) {
  count_frames(log, report.frames);
  report.tracking = {};
  report.latency = {};
  if (const std::vector<double> times = collect(log, &FrameRecord::tracking_ms); !times.empty()) {
    const Description d = describe(times);
    Report::Tracking& t = report.tracking;
    if (d.mean > 0) t.fps = 1000 / d.mean;
    t.p50_ms = percentile(times, 0.5);
    t.p99_ms = percentile(times, 0.99);
    t.mean_ms = d.mean;
    t.min_ms = d.min;
    t.max_ms = d.max;
    t.std_ms = d.standard_deviation;
  }
  if (std::vector<double> times = collect(log, &FrameRecord::blocked_ms); !times.empty()) {
    report.tracking.blocked_p99_ms = percentile(std::move(times), 0.99);
  }
  if (const std::vector<double> ratios = collect(log, &FrameRecord::active_ratio); !ratios.empty()) {
    report.tracking.active_feature_ratio = describe(ratios).mean;
  }
  if (const std::vector<double> times = collect(log, &FrameRecord::latency_ms); !times.empty()) {
    report.latency = {percentile(times, 0.5), percentile(times, 0.99), describe(times).max};
  }
}

Report::Ate to_report(const std::optional<AbsoluteError>& error) {
  if (!error) return {};
  return {error->rmse_m,       error->std_m, error->median_m,
          error->rot_rmse_deg, error->scale, static_cast<int64_t>(error->matched)};
}

Report::Rpe to_report(const std::optional<RelativeError>& error) {
  if (!error) return {};
  return {error->trans_m, error->rot_deg};
}

std::string to_json(const Report& report) {
  JsonWriter writer;
  visit_keys(writer, report);
  return writer.text();
}

Status write_report(const std::filesystem::path& path, const Report& report) {
  return write_file_atomically(path, to_json(report));
}

Result<Report> read_report(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  const Json json = Json::parse(*content, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return error("{} is not a report: no JSON object", path.string());
  Report report;
  JsonReader reader(json);
  visit_keys(reader, report);
  return report;
}

}  // namespace photoslam
