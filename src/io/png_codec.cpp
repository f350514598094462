// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <new>

#include "io/image_codec.h"

namespace photoslam::internal {
namespace {

/// What libpng's callbacks need: they report errors by jumping back into the function that called libpng. Between a
/// setjmp and its longjmp only trivial objects live, so nothing is left undestroyed.
struct PngState {
  std::jmp_buf on_error{};
  char message[128] = "";
  std::string_view unread;
  std::string written;
};

[[noreturn]] void fail(png_structp png, png_const_charp message) {
  auto* state = static_cast<PngState*>(png_get_error_ptr(png));
  std::strncpy(state->message, message, sizeof(state->message) - 1);
  std::longjmp(state->on_error, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

void read_bytes(png_structp png, png_bytep destination, size_t count) {
  auto* state = static_cast<PngState*>(png_get_io_ptr(png));
  if (count > state->unread.size()) fail(png, "the file ends too early");
  std::memcpy(destination, state->unread.data(), count);
  state->unread.remove_prefix(count);
}

void write_bytes(png_structp png, png_bytep source, size_t count) {
  auto* state = static_cast<PngState*>(png_get_io_ptr(png));
  bool stored = true;
  try {
    state->written.append(reinterpret_cast<const char*>(source), count);
  } catch (const std::bad_alloc&) {  // an exception must not pass through libpng
    stored = false;
  }
  if (!stored) fail(png, "out of memory");
}

void flush_nothing(png_structp) {}

class PngReader {
 public:
  explicit PngReader(std::string_view content) {
    state_.unread = content;
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &state_, fail, ignore_warning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  bool read_header() {
    if (info_ == nullptr) return false;
    if (setjmp(state_.on_error) != 0) return false;
    png_set_read_fn(png_, &state_, read_bytes);
    png_read_info(png_, info_);
    return true;
  }

  /// Asks for 8-bit grey or RGB, or for native 16-bit values, and for the rows' layout that follows from it.
  bool choose_layout(bool sixteen_bits) {
    if (setjmp(state_.on_error) != 0) return false;
    if (sixteen_bits) {
      if constexpr (std::endian::native == std::endian::little) png_set_swap(png_);
    } else {
      png_set_expand(png_);
      png_set_strip_16(png_);
      png_set_strip_alpha(png_);
    }
    passes_ = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }

  template <class T>
  bool read_pixels(Image<T>& image) {
    if (setjmp(state_.on_error) != 0) return false;
    for (int pass = 0; pass < passes_; ++pass) {
      for (int y = 0; y < image.height(); ++y) png_read_row(png_, reinterpret_cast<png_bytep>(image.row(y)), nullptr);
    }
    png_read_end(png_, nullptr);
    return true;
  }

  ImageSize size() const { return {png_get_image_width(png_, info_), png_get_image_height(png_, info_)}; }
  int bit_depth() const { return png_get_bit_depth(png_, info_); }
  int channels() const { return png_get_channels(png_, info_); }
  bool grey() const { return png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY; }
  Error damaged() const { return error("damaged PNG: {}", state_.message); }

 private:
  PngState state_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  int passes_ = 1;
};

class PngWriter {
 public:
  PngWriter() {
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, &state_, fail, ignore_warning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  template <class T>
  bool write(const Image<T>& image, int compression) {
    if (info_ == nullptr) return false;
    if (setjmp(state_.on_error) != 0) return false;
    png_set_write_fn(png_, &state_, write_bytes, flush_nothing);
    png_set_compression_level(png_, compression);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(image.width()), static_cast<png_uint_32>(image.height()),
                 8 * sizeof(T), image.channels() == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png_, info_);
    if constexpr (sizeof(T) == 2 && std::endian::native == std::endian::little) png_set_swap(png_);
    for (int y = 0; y < image.height(); ++y) png_write_row(png_, reinterpret_cast<png_const_bytep>(image.row(y)));
    png_write_end(png_, info_);
    return true;
  }

  std::string take() { return std::move(state_.written); }
  Error failure() const { return error("cannot encode PNG: {}", state_.message); }

 private:
  PngState state_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

template <class T>
Result<Image<T>> read_rest(PngReader& reader) {
  if (!reader.choose_layout(sizeof(T) == 2)) return reader.damaged();
  Image<T> image(static_cast<int>(reader.size().width), static_cast<int>(reader.size().height), reader.channels());
  if (!reader.read_pixels(image)) return reader.damaged();
  return image;
}

template <class T>
Result<std::string> encode(const Image<T>& image, int compression) {
  PHOTOSLAM_CHECK(image.channels() == 1 || image.channels() == 3, "{} channels", image.channels());
  PHOTOSLAM_CHECK(!image.empty(), "an empty image");
  PHOTOSLAM_CHECK(compression >= 0 && compression <= 9, "{}", compression);
  PngWriter writer;
  if (!writer.write(image, compression)) return writer.failure();
  return writer.take();
}

}  // namespace

Result<ImageU8> decode_png(std::string_view content) {
  PngReader reader(content);
  if (!reader.read_header()) return reader.damaged();
  if (const Status status = check_size(reader.size()); !status) return status.error();
  return read_rest<uint8_t>(reader);
}

Result<ImageU16> decode_png16(std::string_view content) {
  PngReader reader(content);
  if (!reader.read_header()) return reader.damaged();
  if (const Status status = check_size(reader.size()); !status) return status.error();
  if (reader.bit_depth() != 16 || !reader.grey()) {
    return error("expected a PNG with one channel of 16 bits, found {} of {} bits", reader.channels(),
                 reader.bit_depth());
  }
  return read_rest<uint16_t>(reader);
}

Result<std::string> encode_png(const ImageU8& image, int compression) { return encode(image, compression); }
Result<std::string> encode_png(const ImageU16& image, int compression) { return encode(image, compression); }

}  // namespace photoslam::internal
