// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/packed_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>

#include "base/check.h"

namespace photoslam {
namespace {

/// Lets deflate or inflate work through the input; `last_flush` goes with the last of it.
template <class Step>
int feed(z_stream& stream, std::string_view in, std::span<char> out, size_t most, int last_flush, Step&& step) {
  const char* const in_end = in.data() + in.size();
  char* const out_end = out.data() + out.size();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in.data()));
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  int status = Z_OK;
  while (status == Z_OK) {
    const auto in_left = static_cast<size_t>(in_end - reinterpret_cast<const char*>(stream.next_in));
    const auto out_left = static_cast<size_t>(out_end - reinterpret_cast<char*>(stream.next_out));
    stream.avail_in = static_cast<uInt>(std::min(in_left, most));
    stream.avail_out = static_cast<uInt>(std::min(out_left, most));
    status = step(&stream, in_left <= most ? last_flush : Z_NO_FLUSH);
  }
  return status;
}

}  // namespace

std::string packed(std::string_view bytes, size_t most_at_once) {
  z_stream stream{};
  PHOTOSLAM_CHECK(deflateInit2(&stream, 1, Z_DEFLATED, MAX_WBITS, 9, Z_RLE) == Z_OK, "zlib could not start");
  const uint64_t size = bytes.size();
  std::string result(sizeof(size) + deflateBound(&stream, bytes.size()), '\0');
  std::memcpy(result.data(), &size, sizeof(size));
  const std::span<char> target = std::span(result).subspan(sizeof(size));
  const int status = feed(stream, bytes, target, most_at_once, Z_FINISH, deflate);
  result.resize(sizeof(size) + stream.total_out);
  deflateEnd(&stream);
  PHOTOSLAM_CHECK(status == Z_STREAM_END, "zlib failed to compress {} bytes", size);
  return result;
}

std::optional<std::string> unpacked(std::string_view bytes, size_t most_at_once) {
  uint64_t size = 0;
  if (bytes.size() < sizeof(size)) return std::nullopt;
  std::memcpy(&size, bytes.data(), sizeof(size));
  constexpr uint64_t kMostPerByte = 1032;  // no deflate stream grows by more
  if (size / kMostPerByte > bytes.size()) return std::nullopt;
  z_stream stream{};
  PHOTOSLAM_CHECK(inflateInit(&stream) == Z_OK, "zlib could not start");
  std::string result(size, '\0');
  // To be told that this is the last of it, inflate would want all room for the rest at once.
  const int status = feed(stream, bytes.substr(sizeof(size)), result, most_at_once, Z_NO_FLUSH, inflate);
  const bool whole = status == Z_STREAM_END && stream.total_out == size;
  inflateEnd(&stream);
  return whole ? std::optional(std::move(result)) : std::nullopt;
}

}  // namespace photoslam
