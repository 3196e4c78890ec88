// SPDX-License-Identifier: Apache-2.0
// Serialisation of what was learnt: values one after another, and the header of training files (docs/file-formats.md).
#pragma once

#include <bit>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace covary {

/// Appends the bytes of a value. All supported machines are little-endian.
static_assert(std::endian::native == std::endian::little);
template <typename T>
void append_bytes(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// Reads values from the front of bytes, which must outlive it, as must `where`, the source named in messages.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}
  /// Throws Error(kInput) if too few bytes are left.
  template <typename T>
  T read() {
    T value;
    std::memcpy(static_cast<void*>(&value), take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  std::string_view take(size_t size);
  std::string_view rest() const { return bytes_; }
  /// Throws Error(kInput) unless the values read are `possible`.
  void check(bool possible) const {
    if (!possible) fail("is damaged: it has impossible numbers");
  }
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string_view bytes_;
  const std::string& where_;
};

/// A training file: header and `body`. `key` identifies what was learnt from (scene and settings).
std::string training_file_bytes(const std::string& key, std::string_view body);
/// The body of a training file. Throws Error(kInput) when the bytes are truncated, damaged, of another version, or have
/// another key.
std::string_view training_file_body(std::string_view bytes, const std::string& key, const std::string& where);

}  // namespace covary
