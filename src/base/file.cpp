// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/file.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <fstream>
#include <sstream>

namespace photoslam {
namespace {

Error system_error(std::string_view doing, const std::filesystem::path& path) {
  return error("cannot {} {}: {}", doing, path.string(), std::strerror(errno));
}

Status write_all(int descriptor, std::span<const std::byte> content, const std::filesystem::path& path) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return system_error("write", path);
    content = content.subspan(static_cast<size_t>(written));
  }
  return {};
}

constexpr std::string_view kTemporary = ".photoslam.tmp";

/// Whether it is the temporary file of a process that was killed. Folders may be shared with machines whose processes
/// are not seen here: what was touched within the last minute may still be written.
bool is_left_behind(const std::filesystem::path& path) {
  const std::string name = path.filename();
  if (!name.ends_with(kTemporary)) return false;
  const std::string_view stem = std::string_view(name).substr(0, name.size() - kTemporary.size());
  const std::string_view digits = stem.substr(stem.rfind('.') + 1);
  pid_t process = 0;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), process);
  if (problem != std::errc{} || end != digits.data() + digits.size() || process <= 0) return false;
  if (::kill(process, 0) == 0 || errno != ESRCH) return false;
  std::error_code code;
  const auto age = std::filesystem::file_time_type::clock::now() - std::filesystem::last_write_time(path, code);
  return !code && age > std::chrono::minutes(1);
}

}  // namespace

Status write_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> pieces) {
  std::filesystem::path temporary = path;
  temporary += fmt::format(".{}{}", ::getpid(), kTemporary);
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) return system_error("create", temporary);

  Status status;
  for (const std::string_view piece : pieces) {
    if (status) status = write_all(descriptor, std::as_bytes(std::span(piece)), temporary);
  }
  if (status && ::fsync(descriptor) != 0) status = system_error("flush", temporary);
  if (::close(descriptor) != 0 && status) status = system_error("close", temporary);
  if (status && ::rename(temporary.c_str(), path.c_str()) != 0) status = system_error("replace", path);
  if (!status) ::unlink(temporary.c_str());
  return status;
}

Status write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  return write_file_atomically(path, {content});
}

Status write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content) {
  return write_file_atomically(path, {std::string_view(reinterpret_cast<const char*>(content.data()), content.size())});
}

Result<std::string> read_file(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return error("{} is a folder, expected a file", path.string());
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return system_error("open", path);
  std::ostringstream content;
  content << stream.rdbuf();
  if (stream.bad()) return system_error("read", path);
  return std::move(content).str();
}

Status prepare_output_folder(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) return error("cannot create the output folder {}: {}", folder.string(), code.message());
  const std::filesystem::path probe = folder / fmt::format(".write-test.{}", ::getpid());
  const int descriptor = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) {
    return error("cannot write into the output folder {}: {}; choose another with --output", folder.string(),
                 std::strerror(errno));
  }
  ::close(descriptor);
  ::unlink(probe.c_str());
  std::vector<std::filesystem::path> leftovers;
  for (std::filesystem::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    if (is_left_behind(entry->path())) leftovers.push_back(entry->path());
  }
  for (const std::filesystem::path& leftover : leftovers) ::unlink(leftover.c_str());
  return {};
}

}  // namespace photoslam
