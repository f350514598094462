// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// clang-format off: each of these needs the one before it
#include <cstdio>
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

#include <csetjmp>
#include <cstdlib>

#include "base/file.h"
#include "io/image_codec.h"

namespace photoslam::internal {
namespace {

/// libjpeg reports errors through a callback that must not return; ours jumps back into the function that called it.
/// Between a setjmp and its longjmp only trivial objects live, so nothing is left undestroyed.
struct JpegErrorHandler {
  jpeg_error_mgr manager{};
  std::jmp_buf on_error{};
  char message[JMSG_LENGTH_MAX] = "";
};

[[noreturn]] void fail(j_common_ptr info) {
  auto* handler = reinterpret_cast<JpegErrorHandler*>(info->err);
  handler->manager.format_message(info, handler->message);
  std::longjmp(handler->on_error, 1);
}

/// Warnings mean damaged data, except those about harmless extra bytes or version numbers.
void receive_message(j_common_ptr info, int level) {
  const int code = info->err->msg_code;
  const bool harmless = code == JWRN_EXTRANEOUS_DATA || code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM;
  if (level < 0 && !harmless) fail(info);
}

void install(JpegErrorHandler& handler) {
  jpeg_std_error(&handler.manager);
  handler.manager.error_exit = fail;
  handler.manager.emit_message = receive_message;
}

class JpegReader {
 public:
  JpegReader() {
    install(errors_);
    decoder_.err = &errors_.manager;
  }
  ~JpegReader() { jpeg_destroy_decompress(&decoder_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  bool read_header(std::string_view content) {
    if (setjmp(errors_.on_error) != 0) return false;
    jpeg_create_decompress(&decoder_);
    jpeg_mem_src(&decoder_, reinterpret_cast<const unsigned char*>(content.data()), content.size());
    jpeg_read_header(&decoder_, TRUE);
    decoder_.out_color_space = decoder_.jpeg_color_space == JCS_GRAYSCALE ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_calc_output_dimensions(&decoder_);
    return true;
  }

  bool read_pixels(ImageU8& image) {
    if (setjmp(errors_.on_error) != 0) return false;
    jpeg_start_decompress(&decoder_);
    while (decoder_.output_scanline < decoder_.output_height) {
      JSAMPROW row = image.row(static_cast<int>(decoder_.output_scanline));
      jpeg_read_scanlines(&decoder_, &row, 1);
    }
    jpeg_finish_decompress(&decoder_);
    return true;
  }

  ImageSize size() const { return {decoder_.output_width, decoder_.output_height}; }
  int channels() const { return decoder_.output_components; }
  const char* message() const { return errors_.message; }

 private:
  JpegErrorHandler errors_;
  jpeg_decompress_struct decoder_{};
};

class JpegWriter {
 public:
  JpegWriter() {
    install(errors_);
    encoder_.err = &errors_.manager;
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&encoder_);
    std::free(buffer_);
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  bool write(const ImageU8& image, int quality) {
    if (setjmp(errors_.on_error) != 0) return false;
    jpeg_create_compress(&encoder_);
    jpeg_mem_dest(&encoder_, &buffer_, &size_);
    encoder_.image_width = static_cast<JDIMENSION>(image.width());
    encoder_.image_height = static_cast<JDIMENSION>(image.height());
    encoder_.input_components = image.channels();
    encoder_.in_color_space = image.channels() == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&encoder_);
    jpeg_set_quality(&encoder_, quality, TRUE);
    // Colour at full resolution: pictures to be measured against must not lose it.
    for (int c = 0; c < encoder_.num_components; ++c) {
      encoder_.comp_info[c].h_samp_factor = encoder_.comp_info[c].v_samp_factor = 1;
    }
    jpeg_start_compress(&encoder_, TRUE);
    while (encoder_.next_scanline < encoder_.image_height) {
      JSAMPROW row = const_cast<JSAMPROW>(image.row(static_cast<int>(encoder_.next_scanline)));
      jpeg_write_scanlines(&encoder_, &row, 1);
    }
    jpeg_finish_compress(&encoder_);
    return true;
  }

  std::string_view content() const { return {reinterpret_cast<const char*>(buffer_), size_}; }
  const char* message() const { return errors_.message; }

 private:
  JpegErrorHandler errors_;
  jpeg_compress_struct encoder_{};
  unsigned char* buffer_ = nullptr;
  unsigned long size_ = 0;
};

}  // namespace

Result<ImageU8> decode_jpeg(std::string_view content) {
  JpegReader reader;
  if (!reader.read_header(content)) return error("damaged JPEG: {}", reader.message());
  if (const Status status = check_size(reader.size()); !status) return status.error();
  ImageU8 image(static_cast<int>(reader.size().width), static_cast<int>(reader.size().height), reader.channels());
  if (!reader.read_pixels(image)) return error("damaged JPEG: {}", reader.message());
  return image;
}

Result<std::string> encode_jpeg(const ImageU8& image, int quality) {
  PHOTOSLAM_CHECK(image.channels() == 1 || image.channels() == 3, "{} channels", image.channels());
  PHOTOSLAM_CHECK(!image.empty(), "an empty image");
  PHOTOSLAM_CHECK(quality >= 1 && quality <= 100, "{}", quality);
  JpegWriter writer;
  if (!writer.write(image, quality)) return error("cannot encode JPEG: {}", writer.message());
  return std::string(writer.content());
}

}  // namespace photoslam::internal
