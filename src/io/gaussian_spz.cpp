// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/gaussian_spz.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "base/file.h"

namespace photoslam {
namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in memory");

constexpr uint32_t kMagic = 0x5053474e;  // "NGSP"
constexpr uint32_t kVersion = 3;
constexpr uint8_t kFractionalBits = 12;
constexpr float kLargestPosition = 2047.99f;
constexpr float kColorScale = 0.15f;
constexpr size_t kRestPerChannel = 15;

using Row = std::span<const float, GaussianTable::kColumns>;

bool is_finite(Row row) {
  return std::ranges::all_of(row, [](float v) { return std::isfinite(v); });
}

float sigmoid(float x) { return 1 / (1 + std::exp(-x)); }

uint8_t to_byte(float value) { return static_cast<uint8_t>(std::clamp(std::round(value), 0.0f, 255.0f)); }

template <class T>
void append(std::string& out, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

/// w, x, y, z of norm 1.
std::array<float, 4> unit_quaternion(Row row) {
  std::array<float, 4> q = {1, 0, 0, 0};
  const float* const r = &row[GaussianTable::kRotation];
  const float norm = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
  if (norm > 0) {
    for (size_t i = 0; i < 4; ++i) q[i] = r[i] / norm;
  }
  return q;
}

/// The highest degree with a coefficient that is not zero.
int sh_degree(const GaussianTable& gaussians) {
  size_t highest = 0;  // number of coefficients beyond the constant one
  for (size_t i = 0; i < gaussians.size(); ++i) {
    const Row row = gaussians.row(i);
    for (size_t k = kRestPerChannel; k > highest; --k) {
      for (size_t c = 0; c < 3; ++c) {
        if (row[GaussianTable::kShRest + c * kRestPerChannel + k - 1] != 0) highest = std::max(highest, k);
      }
    }
  }
  return highest == 0 ? 0 : highest <= 3 ? 1 : highest <= 8 ? 2 : 3;
}

void append_position(Row row, std::string& out) {
  for (size_t k = 0; k < 3; ++k) {
    const float sign = k == 0 ? 1.0f : -1.0f;  // y and z point the other way
    const auto fixed = static_cast<int32_t>(std::lround(sign * row[k] * (1 << kFractionalBits)));
    for (int shift = 0; shift < 24; shift += 8) out.push_back(static_cast<char>((fixed >> shift) & 0xff));
  }
}

/// The index of the largest component of (x, y, z, w) in two bits, then sign and nine bits of each of the others.
void append_rotation(Row row, std::string& out) {
  const auto [w, x, y, z] = unit_quaternion(row);
  const std::array<float, 4> q = {x, -y, -z, w};
  size_t largest = 0;
  for (size_t k = 1; k < 4; ++k) {
    if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
  }
  const bool flip = q[largest] < 0;
  auto packed = static_cast<uint32_t>(largest);
  for (size_t k = 0; k < 4; ++k) {
    if (k == largest) continue;
    const bool negative = (q[k] < 0) != flip;
    const float share = std::min(std::abs(q[k]) * std::sqrt(2.0f), 1.0f);
    packed = (packed << 10) | (negative ? 1u << 9 : 0u) | static_cast<uint32_t>(std::lround(511 * share));
  }
  append(out, packed);
}

/// Signs of the coefficients beyond the constant one when y and z turn around.
constexpr std::array<float, kRestPerChannel> kAxisSigns = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

/// 8 bits rounded to the given number of significant ones: what compresses well and nobody sees.
uint8_t quantize_harmonic(float value, int bits) {
  const int bucket = 1 << (8 - bits);
  const int fine = static_cast<int>(std::lround(value * 128)) + 128;
  return static_cast<uint8_t>(std::clamp((fine + bucket / 2) / bucket * bucket, 0, 255));
}

void append_harmonics(Row row, size_t coefficients, std::string& out) {
  constexpr size_t kFirstDegree = 3;
  for (size_t k = 0; k < coefficients; ++k) {
    for (size_t c = 0; c < 3; ++c) {
      const float value = kAxisSigns[k] * row[GaussianTable::kShRest + c * kRestPerChannel + k];
      out.push_back(static_cast<char>(quantize_harmonic(value, k < kFirstDegree ? 5 : 4)));
    }
  }
}

Result<std::string> gzip(const std::string& data) {
  constexpr int kGzipFormat = 16;
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzipFormat, 9, Z_DEFAULT_STRATEGY) != Z_OK) {
    return error("zlib could not start");
  }
  std::string packed(deflateBound(&stream, data.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
  stream.avail_in = static_cast<uInt>(data.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int status = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (status != Z_STREAM_END) return error("zlib failed to compress {} bytes", data.size());
  return packed;
}

}  // namespace

Result<GaussianPlyReport> write_gaussian_spz(const std::filesystem::path& path, const GaussianTable& gaussians) {
  std::vector<size_t> kept;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    const Row row = gaussians.row(i);
    const bool in_range = std::abs(row[0]) < kLargestPosition && std::abs(row[1]) < kLargestPosition &&
                          std::abs(row[2]) < kLargestPosition;
    if (is_finite(row) && in_range) kept.push_back(i);
  }
  const int degree = sh_degree(gaussians);
  std::string data;
  append(data, kMagic);
  append(data, kVersion);
  append(data, static_cast<uint32_t>(kept.size()));
  for (const uint8_t byte : {static_cast<uint8_t>(degree), kFractionalBits, uint8_t{0}, uint8_t{0}}) append(data, byte);
  for (const size_t i : kept) append_position(gaussians.row(i), data);
  for (const size_t i : kept) append(data, to_byte(255 * sigmoid(gaussians.row(i)[GaussianTable::kOpacity])));
  for (const size_t i : kept) {
    for (size_t c = 0; c < 3; ++c) {
      append(data, to_byte(255 * (kColorScale * gaussians.row(i)[GaussianTable::kShDc + c] + 0.5f)));
    }
  }
  for (const size_t i : kept) {
    for (size_t k = 0; k < 3; ++k) append(data, to_byte(16 * (gaussians.row(i)[GaussianTable::kScale + k] + 10)));
  }
  for (const size_t i : kept) append_rotation(gaussians.row(i), data);
  const auto coefficients = static_cast<size_t>(degree * (degree + 2));
  for (const size_t i : kept) append_harmonics(gaussians.row(i), coefficients, data);

  const Result<std::string> packed = gzip(data);
  if (!packed) return error("{}: {}", path.string(), packed.error().message);
  if (Status status = write_file_atomically(path, *packed); !status) return status.error();
  return GaussianPlyReport{kept.size(), gaussians.size() - kept.size()};
}

Result<GaussianPlyReport> write_gaussian_splat(const std::filesystem::path& path, const GaussianTable& gaussians) {
  constexpr float kSh0 = 0.28209479177387814f;
  std::vector<std::pair<float, size_t>> order;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    const Row row = gaussians.row(i);
    if (!is_finite(row)) continue;
    const float* const s = &row[GaussianTable::kScale];
    order.emplace_back(-sigmoid(row[GaussianTable::kOpacity]) * std::exp(s[0] + s[1] + s[2]), i);
  }
  std::ranges::sort(order);
  std::string data;
  for (const auto& entry : order) {
    const Row row = gaussians.row(entry.second);
    for (size_t k = 0; k < 3; ++k) append(data, row[k]);
    for (size_t k = 0; k < 3; ++k) append(data, std::exp(row[GaussianTable::kScale + k]));
    for (size_t c = 0; c < 3; ++c) append(data, to_byte(255 * (0.5f + kSh0 * row[GaussianTable::kShDc + c])));
    append(data, to_byte(255 * sigmoid(row[GaussianTable::kOpacity])));
    for (const float component : unit_quaternion(row)) append(data, to_byte(128 * component + 128));
  }
  if (Status status = write_file_atomically(path, data); !status) return status.error();
  return GaussianPlyReport{order.size(), gaussians.size() - order.size()};
}

}  // namespace photoslam
