// SPDX-License-Identifier: Apache-2.0
// Functions of a shared library that is loaded when needed.
#pragma once

#include <dlfcn.h>

#include <string>
#include <vector>

namespace covary::device {

/// A loaded library, which stays loaded until the program ends: drivers have threads of their own.
class Library {
 public:
  /// The first of the files that can be loaded; otherwise `why` says what the loader says of the first of them.
  Library(const std::vector<std::string>& files, std::string& why) {
    for (const std::string& file : files) {
      handle_ = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
      if (handle_) {
        why.clear();  // of the files before it
        return;
      }
      if (why.empty()) why = dlerror();
    }
  }
  explicit operator bool() const { return handle_ != nullptr; }

  /// Whether the library has the function; otherwise `why` names it.
  template <typename Function>
  bool bind(const char* name, Function*& function, std::string& why) const {
    function = reinterpret_cast<Function*>(dlsym(handle_, name));
    if (!function && why.empty()) why = std::string("no function ") + name;
    return function != nullptr;
  }

 private:
  void* handle_ = nullptr;
};

/// The functions of a library, or why they cannot be had.
template <typename Functions>
struct Loaded {
  Functions all = {};
  std::string why;
  /// Null, with the reason, where a function is missing.
  const Functions* get(std::string* reason) const {
    if (!why.empty() && reason) *reason = why;
    return why.empty() ? &all : nullptr;
  }
};

}  // namespace covary::device
