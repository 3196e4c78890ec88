// SPDX-License-Identifier: Apache-2.0
// Tensor files for tests, as strings (format: tensors/tensor_file.h).
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace covary::test_support {

/// A field with its values in the file's order.
struct TensorField {
  std::string name;
  std::vector<uint64_t> shape;
  std::string values;
  uint8_t type;
};

inline TensorField float_field(const std::string& name, const std::vector<uint64_t>& shape,
                               const std::vector<float>& values) {
  std::string bytes(values.size() * sizeof(float), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return {name, shape, bytes, 10};
}

template <typename T>
std::string bytes_of(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

inline std::string tensor_text(const std::vector<TensorField>& fields) {
  std::string head = std::string("tensor_file") + '\0' + '\1' + '\0' + bytes_of(static_cast<uint32_t>(fields.size()));
  uint64_t place = head.size();
  for (const TensorField& f : fields) place += 2 + f.name.size() + 2 + 1 + 8 + 8 * f.shape.size();
  std::string body;
  for (const TensorField& f : fields) {
    head += bytes_of(static_cast<uint16_t>(f.name.size())) + f.name + bytes_of(static_cast<uint16_t>(f.shape.size()));
    head += static_cast<char>(f.type) + bytes_of(place + body.size());
    for (const uint64_t length : f.shape) head += bytes_of(length);
    body += f.values;
  }
  return head + body;
}

}  // namespace covary::test_support
