// SPDX-License-Identifier: Apache-2.0
#include "sampling/training_bytes.h"

#include <fmt/format.h>

#include "core/content_hash.h"
#include "core/error.h"

namespace covary {
namespace {

constexpr std::string_view kMagic = "covary coefficients\n";
constexpr uint32_t kVersion = 3;

}  // namespace

std::string_view ByteReader::take(size_t size) {
  if (bytes_.size() < size) fail("is truncated: the training file ends too early");
  const std::string_view taken = bytes_.substr(0, size);
  bytes_.remove_prefix(size);
  return taken;
}

void ByteReader::fail(const std::string& what) const {
  throw Error(ErrorCode::kInput, fmt::format("{}: {}", where_, what));
}

std::string training_file_bytes(const std::string& key, std::string_view body) {
  std::string bytes(kMagic);
  append_bytes(bytes, kVersion), append_bytes(bytes, uint64_t{key.size()}), bytes += key;
  append_bytes(bytes, uint64_t{body.size()}), append_bytes(bytes, hash_bytes(body)), bytes += body;
  return bytes;
}

std::string_view training_file_body(std::string_view bytes, const std::string& key, const std::string& where) {
  ByteReader reader(bytes, where);
  if (!bytes.starts_with(kMagic.substr(0, bytes.size())))
    reader.fail("is not a training file, as `save-training` writes them");
  reader.take(kMagic.size());
  const auto version = reader.read<uint32_t>();
  if (version != kVersion)
    reader.fail(fmt::format("is a training file of version {}; this program reads version {}", version, kVersion));
  const std::string_view found = reader.take(reader.read<uint64_t>());
  const auto size = reader.read<uint64_t>(), hash = reader.read<uint64_t>();
  if (reader.rest().size() < size)
    reader.fail(fmt::format("is truncated: it has {} of {} bytes", reader.rest().size(), size));
  if (reader.rest().size() > size || hash_bytes(reader.rest()) != hash)
    reader.fail("is damaged: its content does not match its checksum");
  if (found != key)
    reader.fail(fmt::format("was trained for another scene or with other settings: '{}'; '{}' is needed", found, key));
  return reader.rest();
}

}  // namespace covary
