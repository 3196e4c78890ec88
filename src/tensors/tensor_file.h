// SPDX-License-Identifier: Apache-2.0
// "Tensor files", the container format of measured materials (RGL's *.bsdf): named arrays of numbers.
//
// Format, little endian: "tensor_file\0", version bytes 1 and 0, uint32 number of fields; then for each field: uint16
// length of the name, name, uint16 number of dimensions, uint8 type, uint64 offset of its values in the file, uint64
// length of each dimension. Arrays are row-major.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace covary {

class TensorFile {
 public:
  /// Reads the list of fields. Throws Error(kIo) if the file cannot be read, Error(kInput) if it is not a tensor file
  /// or a field lies outside it.
  explicit TensorFile(const std::string& path);

  bool has(const std::string& field) const { return fields_.contains(field); }
  /// Length of each dimension. Throws Error(kInput) if there is no such field.
  const std::vector<uint64_t>& shape(const std::string& field) const { return find(field).shape; }
  /// Values of a field of 32-bit floats. Throws Error(kInput) if there is no such field, it has another type or values
  /// that are not finite; Error(kIo) if it cannot be read.
  std::vector<float> floats(const std::string& field) const;
  /// The same for a field of bytes.
  std::vector<uint8_t> bytes(const std::string& field) const;
  /// Size of the file in bytes.
  uint64_t n_bytes() const { return n_bytes_; }

 private:
  struct Field {
    int type = 0;
    uint64_t place = 0, count = 0;  // offset in the file, and number of values
    std::vector<uint64_t> shape;
  };
  const Field& find(const std::string& field) const;
  void read_values(const std::string& name, int type, size_t size, void* to) const;

  std::string path_;
  uint64_t n_bytes_ = 0;
  std::map<std::string, Field> fields_;
};

/// "[1, 8, 32, 32]".
std::string shape_text(const std::vector<uint64_t>& shape);

}  // namespace covary
