// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "backend_arguments.h"
#include "base/file.h"
#include "base/version.h"
#include "commands.h"
#include "config_arguments.h"
#include "evaluation/report_html.h"
#include "evaluation/run_evaluation.h"
#include "evaluation/true_trajectory.h"
#include "interrupt.h"
#include "pipeline/frame_rectifier.h"
#include "pipeline/session_file.h"
#include "pipeline/system.h"
#include "preview_writer.h"
#include "progress_line.h"
#include "result_table.h"
#include "run_folder.h"
#include "run_notes.h"
#include "sources/ground_truth.h"
#include "sources/sensor_choice.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  fs::path dataset;
  std::string sensor = "auto";
  SourceOptions source;
  fs::path output = "output/run";
  fs::path preview;
  std::string pace = "realtime";
  int iterations_per_frame = -1;
  double map_until_s = -1;
  fs::path load_map;
  bool no_session = false;
  RunSettings settings;
  BackendArguments backend;
  ConfigArguments config;
  bool json = false;
};

Status configure(const RunArguments& arguments, SystemOptions& options, RunSettings& settings) {
  Result<SystemOptions> loaded = arguments.config.load();
  if (!loaded) return loaded.error();
  options = *loaded;
  settings = arguments.settings;
  if (arguments.iterations_per_frame >= 0) {
    options.pipeline.iterations_per_frame = arguments.iterations_per_frame;
    settings.logical_time = true;
  }
  settings.preview = !arguments.preview.empty();
  if (arguments.map_until_s >= 0) settings.map_until_s = arguments.map_until_s;
  if (settings.deterministic || settings.logical_time || arguments.pace == "asap") settings.pace = Pace::asap;
  if (!arguments.no_session) settings.session_file = arguments.output / kSessionFile;
  return {};
}

/// Combinations of options that contradict each other.
void check_combinations(const RunArguments& arguments, bool wants_realtime) {
  const RunSettings& settings = arguments.settings;
  check_hold_out(settings.hold_out);
  if (wants_realtime && (settings.deterministic || arguments.iterations_per_frame >= 0)) {
    throw CLI::ValidationError("--pace realtime",
                               fmt::format("{} counts training by frames, whatever the clock says",
                                           settings.deterministic ? "--deterministic" : "--iterations-per-frame"));
  }
  if (settings.deterministic && settings.refine_seconds > 0) {
    throw CLI::ValidationError("--refine-seconds",
                               "depends on the clock; with --deterministic use --refine-iterations");
  }
  if (settings.localize_only && (settings.refine_seconds > 0 || settings.refine_iterations > 0)) {
    throw CLI::ValidationError("--localize-only", "leaves the map as it is: there is nothing to refine");
  }
}

Status load_session(const fs::path& path, const SystemOptions& options, const SourceInfo& info, RunSettings& settings) {
  if (path.empty()) return {};
  auto session = read_session(path);
  if (!session) return session.error();
  if (Status fits = check_session(*session, options, info); !fits) {
    return error("{}: {}", path.string(), fits.error().message);
  }
  for (const std::string& line : describe_changed_options(session_header(*session), options)) {
    fmt::print(stderr, "  note: {}\n", line);
  }
  settings.loaded_session = std::make_shared<const std::string>(std::move(*session));
  return {};
}

void announce(const SourceInfo& info, const RunArguments& arguments) {
  fmt::print(stderr, "{}: {} frames, {}x{}, {:.4g} Hz, format {}, sensor {}{}\n", info.name, info.num_frames,
             info.camera.width, info.camera.height, info.frames_per_second, info.format, sensor_name(info.sensor),
             arguments.source.sensor ? "" : " (guessed from the data; --sensor tells)");
  for (const std::string& note : info.notes) fmt::print(stderr, "  note: {}\n", note);
  fmt::print(stderr, "writing to {}\n", arguments.output.string());
}

/// Whether the map that is continued is the one in the output folder.
bool continues_in_place(const RunArguments& arguments) {
  std::error_code ignored;
  if (arguments.load_map.empty()) return false;
  const fs::path map = fs::absolute(arguments.load_map);
  return fs::equivalent(fs::is_directory(map) ? map : map.parent_path(), arguments.output, ignored);
}

/// What an earlier run has left in the folder goes as this one's results come, its session too.
void announce_replacement(const RunArguments& arguments) {
  if (continues_in_place(arguments)) return;
  if (fs::exists(arguments.output / kSessionFile) || fs::exists(arguments.output / "map.ply"))
    fmt::print(stderr, "  note: the results of an earlier run in {} will be replaced\n", arguments.output.string());
}

void remove_replaced_session(const RunArguments& arguments, const RunSettings& settings) {
  std::error_code ignored;
  const bool writes_one = !settings.session_file.empty() && !settings.localize_only;
  if (!writes_one && !continues_in_place(arguments)) fs::remove(arguments.output / kSessionFile, ignored);
}

/// What is left of a camera after the run: nothing to compare the map with.
class NoFrames final : public FrameSource {
 public:
  explicit NoFrames(SourceInfo info) : info_(std::move(info)) {}
  const SourceInfo& info() const override { return info_; }
  std::optional<Frame> next() override { return std::nullopt; }

 private:
  SourceInfo info_;
};

Result<std::unique_ptr<FrameSource>> reopen(const fs::path& path, const SourceOptions& options,
                                            const SourceInfo& info) {
  if (is_camera(path)) return std::unique_ptr<FrameSource>(std::make_unique<NoFrames>(info));
  return open_source(path, options);
}

/// Trajectories and map are on disk before anything is measured.
Status save_and_evaluate(const RunArguments& arguments, const SystemOptions& options, const RunSettings& settings,
                         const SourceInfo& info, const RunOutcome& run) {
  const RunDescription description{arguments.dataset, arguments.source, FrameRectifier(info).camera(),
                                   settings.hold_out};
  size_t map_bytes = 0;
  if (Status status = write_run_description(arguments.output, description); !status) return status;
  if (Status status = write_run_results(arguments.output, run, map_bytes); !status) return status;
  remove_replaced_session(arguments, settings);

  auto source = reopen(arguments.dataset, description.source, info);
  if (!source) return source.error();
  std::optional<Trajectory> truth;
  if (const auto path = find_ground_truth(arguments.dataset)) {
    auto read = read_true_trajectory(*path, info);
    if (read) {
      truth = std::move(*read);
    } else {
      fmt::print(stderr, "  note: no trajectory error: {}\n", read.error().message);
    }
  }
  const int threads = settings.threads > 0 ? settings.threads : static_cast<int>(std::thread::hardware_concurrency());
  ThreadPool executor(std::max(1, threads));
  fmt::print(stderr, "measuring\n");
  HtmlReport html = evaluate_run(run, options, **source, truth, !run.interrupted, executor);
  if (truth && !html.report.ate.rmse_m) {
    fmt::print(stderr, "  note: no trajectory error: fewer than three true poses within 20 ms of those of the run\n");
  }
  html.report.map.size_mb = 1e-6 * static_cast<double>(map_bytes);
  if (settings.gpu) html.report.machine += "; GPU " + settings.gpu->name();
  if (Status status = write_report(arguments.output / "report.json", html.report); !status) return status;
  if (Status status = write_html_report(arguments.output / "report.html", html); !status) return status;
  fmt::print("{}", arguments.json ? to_json(html.report) : result_table(html.report));
  if (!arguments.json) fmt::print("  {:<18}{}\n", "report", (arguments.output / "report.html").string());
  return {};
}

Status run(const RunArguments& arguments) {
  const InterruptGuard interrupt;  // before a camera or a GPU begins a thread
  SystemOptions options;
  RunSettings settings;
  if (Status status = configure(arguments, options, settings); !status) return status;
  auto source = open_source(arguments.dataset, arguments.source);
  if (!source) return source.error();
  const SourceInfo info = (*source)->info();
  if (Status status = load_session(arguments.load_map, options, info, settings); !status) return status;
  if (Status status = prepare_output_folder(arguments.output); !status) return status;
  announce(info, arguments);
  announce_replacement(arguments);
  auto gpu = arguments.backend.open();
  if (!gpu) return gpu.error();
  settings.gpu = *gpu;
  if (interrupt.token().stop_requested()) return error("interrupted before anything was mapped");

  RunOutcome outcome;
  {
    ProgressLine line;
    PreviewWriter preview(arguments.preview);
    outcome = run_slam(options, settings, **source, interrupt.token(), [&](const Progress& p) {
      line.show(p);
      preview.show(p);
    });
    if (!preview.failure().empty()) fmt::print(stderr, "  note: no preview: {}\n", preview.failure());
  }
  for (const std::string& message : outcome.messages) fmt::print(stderr, "  note: {}\n", message);
  for (const std::string& note : notes_on(outcome, settings)) fmt::print(stderr, "  note: {}\n", note);
  report_failure(gpu->get());
  if (outcome.gpu && !outcome.gpu->undistortion_failure.empty()) {
    fmt::print(stderr, "  note: the GPU has failed to undistort ({}); from then on the CPU did it\n",
               outcome.gpu->undistortion_failure);
  }
  if (outcome.final.keyframes_from_world.empty()) {
    return error("nothing could be mapped: {}", why_nothing_was_mapped(outcome, info.sensor));
  }
  if (Status status = save_and_evaluate(arguments, options, settings, info, outcome); !status) return status;
  if (!outcome.failure.empty()) return error("{}; what was made so far is saved", outcome.failure);
  return {};
}

}  // namespace

void add_run(CommandLine& line) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App& command = line.add("run", "Track a sequence and map it photorealistically",
                               "  photoslam run rgbd_dataset_freiburg1_desk --output output/desk\n"
                               "  photoslam run Replica/office0 --refine-seconds 30\n"
                               "  photoslam run holiday.mp4 --fov 70\n"
                               "  photoslam run camera:0 --camera webcam.yaml\n"
                               "  photoslam run my_sequence --deterministic --seed 7 --hold-out 8\n");
  RunArguments& a = *arguments;
  command.add_option("dataset", a.dataset, "Folder of the sequence or of images, video file, or camera (camera:0)")
      ->required();
  command
      .add_option("--sensor", a.sensor,
                  "Sensor of the sequence; auto takes all it has, mono leaves depth or the right "
                  "images out")
      ->check(CLI::IsMember({"auto", "mono", "stereo", "rgbd"}))
      ->capture_default_str();
  std::vector<std::string> formats = source_formats();
  formats.insert(formats.begin(), "auto");
  command.add_option("--format", a.source.format, "Layout of the sequence")
      ->check(CLI::IsMember(formats))
      ->capture_default_str();
  CLI::Option* calibration =
      command.add_option("--camera", a.source.camera,
                         "Calibration to use instead of the sequence's own: camera.yaml, OpenCV, ORB-SLAM, "
                         "EuRoC's sensor.yaml or KITTI's calib.txt");
  command
      .add_option("--fov", a.source.fov_deg, "Without a calibration: guess one of this horizontal field of view [deg]")
      ->check(CLI::Range(5.0, 170.0))
      ->excludes(calibration);
  command.add_option("--fps", a.source.frames_per_second, "Rate of the images of a folder [Hz]")
      ->check(CLI::Range(0.01, 10000.0));
  command.add_option("--output", a.output, "Folder for the results")->capture_default_str();
  command.add_option("--preview", a.preview,
                     "Picture rewritten every second: the newest keyframe beside its render, and the trajectory");
  const CLI::Option* const pace =
      command.add_option("--pace", a.pace, "Release frames at their timestamps, or as fast as they are tracked")
          ->check(CLI::IsMember({"realtime", "asap"}))
          ->capture_default_str();
  command.add_option("--refine-seconds", a.settings.refine_seconds, "Keep training so long after the last frame")
      ->check(CLI::Range(0.0, 1e6));
  command.add_option("--refine-iterations", a.settings.refine_iterations, "The same, counted in iterations")
      ->check(CLI::Range(0, 100000000));
  command.add_flag("--deterministic", a.settings.deterministic,
                   "The same bytes in every run, at any number of threads; implies --pace asap");
  command.add_option("--seed", a.settings.seed, "Seed of everything random")->capture_default_str();
  command.add_option("--hold-out", a.settings.hold_out, "Track every Nth frame but never map it, to score it")
      ->check(CLI::Range(0, 1000000));
  command.add_option("--map-until", a.map_until_s, "Map the first T seconds, then only track [s]")
      ->check(CLI::Range(0.0, 1e9));
  command
      .add_option("--iterations-per-frame", a.iterations_per_frame,
                  "Let tracking wait for so many training iterations per frame: best quality offline")
      ->check(CLI::Range(0, 1000));
  CLI::Option* load_map =
      command.add_option("--load-map", a.load_map, "Session to continue: session.photoslam or the folder of its run");
  command.add_flag("--localize-only", a.settings.localize_only, "Track in the loaded map and leave the map as it is")
      ->needs(load_map);
  command.add_flag("--no-session", a.no_session, "Write no session.photoslam: the map cannot be continued");
  command
      .add_option("--autosave", a.settings.autosave_s, "Save the session this often in between [s]; 0: only at the end")
      ->check(CLI::Range(0.0, 1e6));
  command.add_option("--threads", a.settings.threads, "Threads for mapping; 0: one per core")
      ->check(CLI::Range(0, 1024));
  a.backend.bind(command);
  a.config.bind(command);
  command.add_flag("--json", a.json, "Print the report as JSON instead of the table");
  line.on_run(command, [arguments, pace]() -> Status {
    const auto sensor = parse_sensor(arguments->sensor);
    if (!sensor) return sensor.error();
    check_combinations(*arguments, pace->count() > 0 && arguments->pace == "realtime");
    arguments->source.sensor = *sensor;
    return run(*arguments);
  });
}

}  // namespace photoslam
