// SPDX-License-Identifier: Apache-2.0
// "Tensor files", the containers of measured materials (RGL's *.bsdf): named arrays of numbers.
//
// Bytes, little endian: "tensor_file\0", version 1 and 0, uint32 number of fields; then for each field uint16 length of
// the name, name, uint16 number of dimensions, uint8 type, uint64 place of its values in the file, uint64 for each
// dimension. Values lie row by row, the last dimension the fastest.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace covary {

class TensorFile {
 public:
  /// Reads the list of fields. Throws Error(kIo) where the file cannot be read, Error(kInput) where it is none of
  /// these files, or a field does not lie inside it.
  explicit TensorFile(const std::string& path);

  bool has(const std::string& field) const { return fields_.contains(field); }
  /// Length along each dimension; throws Error(kInput) when there is no such field.
  const std::vector<uint64_t>& shape(const std::string& field) const { return find(field).shape; }
  /// Values of a field of 32-bit floats. Throws Error(kInput) for other types, values that are not finite, and when
  /// there is no such field; Error(kIo) where it cannot be read.
  std::vector<float> floats(const std::string& field) const;
  /// The same for a field of bytes.
  std::vector<uint8_t> bytes(const std::string& field) const;
  /// Length of the file in bytes.
  uint64_t n_bytes() const { return n_bytes_; }

 private:
  struct Field {
    int type = 0;
    uint64_t place = 0, count = 0;  // where the values begin, and how many there are
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
