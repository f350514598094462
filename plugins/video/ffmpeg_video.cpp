// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// Decodes video with FFmpeg's libraries (LGPL), behind sources/video/video_plugin.h.
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

#include "sources/video/video_plugin.h"

namespace {

template <class T, void (*Free)(T**)>
struct Deleter {
  void operator()(T* pointer) const { Free(&pointer); }
};

struct Reader {
  std::unique_ptr<AVFormatContext, Deleter<AVFormatContext, avformat_close_input>> format;
  std::unique_ptr<AVCodecContext, Deleter<AVCodecContext, avcodec_free_context>> codec;
  std::unique_ptr<AVPacket, Deleter<AVPacket, av_packet_free>> packet{av_packet_alloc()};
  std::unique_ptr<AVFrame, Deleter<AVFrame, av_frame_free>> frame{av_frame_alloc()};
  SwsContext* scaler = nullptr;
  AVStream* stream = nullptr;
  bool draining = false;
  long long decoded = 0;

  ~Reader() { sws_freeContext(scaler); }
};

void explain(char* error, int size, const char* what, int code) {
  char reason[AV_ERROR_MAX_STRING_SIZE] = "";
  if (code < 0) av_strerror(code, reason, sizeof(reason));
  std::snprintf(error, static_cast<size_t>(size), "%s%s%s", what, code < 0 ? ": " : "", reason);
}

int rotation(const AVStream* stream) {
  const auto* matrix =
      reinterpret_cast<const int32_t*>(av_stream_get_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr));
  if (matrix == nullptr) return 0;
  const double counterclockwise = av_display_rotation_get(matrix);
  if (std::isnan(counterclockwise)) return 0;
  const long quarter = std::lround(-counterclockwise / 90);
  return static_cast<int>(((quarter % 4) + 4) % 4 * 90);
}

void* open_reader(const char* path, PhotoslamVideoInfo* info, char* error, int size) {
  av_log_set_level(AV_LOG_QUIET);
  auto reader = std::make_unique<Reader>();
  AVFormatContext* format = nullptr;
  int code = avformat_open_input(&format, path, nullptr, nullptr);
  reader->format.reset(format);
  if (code >= 0) code = avformat_find_stream_info(format, nullptr);
  if (code < 0) return explain(error, size, "cannot be opened as a video", code), nullptr;
  if (std::strcmp(format->iformat->name, "tty") == 0) return explain(error, size, "is text, not a video", 0), nullptr;
  const AVCodec* decoder = nullptr;
  const int index = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, &decoder, 0);
  if (index < 0 || decoder == nullptr) return explain(error, size, "holds no video that can be decoded", 0), nullptr;
  reader->stream = format->streams[index];
  reader->codec.reset(avcodec_alloc_context3(decoder));
  avcodec_parameters_to_context(reader->codec.get(), reader->stream->codecpar);
  reader->codec->thread_count = 1;
  code = avcodec_open2(reader->codec.get(), decoder, nullptr);
  if (code < 0) return explain(error, size, "the decoder does not start", code), nullptr;
  if (reader->codec->width <= 0 || reader->codec->height <= 0) {
    return explain(error, size, "the size of its images is unknown", 0), nullptr;
  }
  const AVRational rate = av_guess_frame_rate(format, reader->stream, nullptr);
  *info = {reader->codec->width, reader->codec->height, rate.den > 0 ? av_q2d(rate) : 0.0, reader->stream->nb_frames,
           rotation(reader->stream)};
  return reader.release();
}

int convert(Reader& reader, unsigned char* rgb, long long* timestamp_ns, char* error, int size) {
  const AVFrame& frame = *reader.frame;
  const int width = reader.codec->width, height = reader.codec->height;
  if (frame.width != width || frame.height != height) return explain(error, size, "an image of another size", 0), -1;
  reader.scaler =
      sws_getCachedContext(reader.scaler, width, height, static_cast<AVPixelFormat>(frame.format), width, height,
                           AV_PIX_FMT_RGB24, SWS_BICUBIC | SWS_ACCURATE_RND, nullptr, nullptr, nullptr);
  if (reader.scaler == nullptr) return explain(error, size, "colours that cannot be converted", 0), -1;
  unsigned char* const planes[] = {rgb};
  const int strides[] = {3 * width};
  sws_scale(reader.scaler, frame.data, frame.linesize, 0, height, planes, strides);
  const long long index = reader.decoded++;
  if (frame.best_effort_timestamp == AV_NOPTS_VALUE) {
    const AVRational rate = av_guess_frame_rate(reader.format.get(), reader.stream, nullptr);
    *timestamp_ns = rate.num > 0 ? std::llround(1e9 * static_cast<double>(index) / av_q2d(rate)) : index;
  } else {
    const AVRational nanoseconds = {1, 1'000'000'000};
    const long long start = reader.stream->start_time == AV_NOPTS_VALUE ? 0 : reader.stream->start_time;
    *timestamp_ns = av_rescale_q(frame.best_effort_timestamp - start, reader.stream->time_base, nanoseconds);
  }
  return 1;
}

int next_frame(void* handle, unsigned char* rgb, long long* timestamp_ns, char* error, int size) {
  Reader& reader = *static_cast<Reader*>(handle);
  while (true) {
    int code = avcodec_receive_frame(reader.codec.get(), reader.frame.get());
    if (code >= 0) return convert(reader, rgb, timestamp_ns, error, size);
    if (code == AVERROR_EOF || reader.draining) return 0;
    if (code != AVERROR(EAGAIN)) return explain(error, size, "an image cannot be decoded", code), -1;
    code = av_read_frame(reader.format.get(), reader.packet.get());
    if (code < 0) {
      reader.draining = avcodec_send_packet(reader.codec.get(), nullptr) < 0;
      continue;
    }
    const bool ours = reader.packet->stream_index == reader.stream->index;
    code = ours ? avcodec_send_packet(reader.codec.get(), reader.packet.get()) : 0;
    av_packet_unref(reader.packet.get());
    if (code < 0) return explain(error, size, "an image cannot be decoded", code), -1;
  }
}

void close_reader(void* handle) { delete static_cast<Reader*>(handle); }

}  // namespace

extern "C" const PhotoslamVideoApi* photoslam_video_api() {
  static const PhotoslamVideoApi kApi = {kPhotoslamVideoApiVersion, open_reader, next_frame, close_reader};
  return &kApi;
}
