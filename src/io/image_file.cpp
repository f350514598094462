// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/image_file.h"

#include "base/file.h"
#include "io/image_codec.h"

namespace photoslam {
namespace internal {

Status check_size(const ImageSize& size) {
  constexpr size_t kMaxSide = 1 << 16;
  constexpr size_t kMaxPixels = 1 << 27;
  if (size.width == 0 || size.height == 0 || size.width > kMaxSide || size.height > kMaxSide ||
      size.width * size.height > kMaxPixels) {
    return error("an image of {}x{} pixels; the largest accepted has {} million", size.width, size.height,
                 kMaxPixels / 1'000'000);
  }
  return {};
}

bool looks_like_png(std::string_view content) { return content.starts_with("\x89PNG\r\n\x1a\n"); }
bool looks_like_jpeg(std::string_view content) { return content.starts_with("\xff\xd8\xff"); }

}  // namespace internal

namespace {

Result<std::string> read_image_content(const std::filesystem::path& path) {
  Result<std::string> content = read_file(path);
  if (content && content->empty()) return error("{} is empty (0 bytes)", path.string());
  return content;
}

template <class T>
Result<T> name_file(Result<T> result, const std::filesystem::path& path) {
  if (!result) return error("{}: {}", path.string(), result.error().message);
  return result;
}

Status write_encoded(const std::filesystem::path& path, const Result<std::string>& encoded) {
  if (!encoded) return error("{}: {}", path.string(), encoded.error().message);
  return write_file_atomically(path, *encoded);
}

}  // namespace

Result<ImageU8> read_image(const std::filesystem::path& path) {
  const Result<std::string> content = read_image_content(path);
  if (!content) return content.error();
  if (internal::looks_like_png(*content)) return name_file(internal::decode_png(*content), path);
  if (internal::looks_like_jpeg(*content)) return name_file(internal::decode_jpeg(*content), path);
  return error("{} is neither a PNG nor a JPEG image", path.string());
}

Result<ImageU16> read_depth_png(const std::filesystem::path& path) {
  const Result<std::string> content = read_image_content(path);
  if (!content) return content.error();
  if (!internal::looks_like_png(*content)) return error("{} is not a PNG image", path.string());
  return name_file(internal::decode_png16(*content), path);
}

Status write_png(const std::filesystem::path& path, const ImageU8& image, int compression) {
  return write_encoded(path, internal::encode_png(image, compression));
}

Status write_png(const std::filesystem::path& path, const ImageU16& image, int compression) {
  return write_encoded(path, internal::encode_png(image, compression));
}

Result<std::string> encode_jpeg(const ImageU8& image, int quality) { return internal::encode_jpeg(image, quality); }

Status write_jpeg(const std::filesystem::path& path, const ImageU8& image, int quality) {
  return write_encoded(path, encode_jpeg(image, quality));
}

}  // namespace photoslam
