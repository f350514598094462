// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/module.h"

#include <dlfcn.h>

#include <filesystem>

namespace photoslam {

Result<void*> find_in_module(const std::string& file_name, const std::string& symbol) {
  namespace fs = std::filesystem;
  std::error_code code;
  const fs::path program = fs::read_symlink("/proc/self/exe", code).parent_path();
  std::string found;
  for (const fs::path& folder : {program, program.parent_path(), program.parent_path() / "lib" / "photoslam"}) {
    const fs::path path = folder / file_name;
    if (!fs::exists(path, code)) continue;
    void* const module = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) {
      found = fmt::format(" ({})", ::dlerror());
    } else if (void* const address = ::dlsym(module, symbol.c_str())) {
      return address;
    } else {
      found = fmt::format(" ({} lacks {})", path.string(), symbol);
    }
  }
  return error("no usable {} beside the program{}", file_name, found);
}

}  // namespace photoslam
