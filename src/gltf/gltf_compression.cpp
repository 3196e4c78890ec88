// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_compression.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "core/error.h"

#ifdef COVARY_DRACO
#include <draco/compression/decode.h>
#endif
#ifdef COVARY_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif
#ifdef COVARY_WEBP
#include <webp/decode.h>
#endif

namespace covary {
namespace {

[[noreturn]] void refuse(const std::string& problem) { throw Error(ErrorCode::kInput, problem); }
[[noreturn]] [[maybe_unused]] void refuse_missing(const char* method, const char* package) {
  refuse(
      fmt::format("is compressed by {}, and covary was built without {}; build it with the latter, or export "
                  "without compression",
                  method, package));
}

[[maybe_unused]] const unsigned char* start(std::string_view bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

}  // namespace

#ifdef COVARY_MESHOPTIMIZER
std::string decode_meshopt(std::string_view bytes, size_t count, size_t stride, const std::string& mode,
                           const std::string& filter) {
  const bool is_attribute = mode == "ATTRIBUTES", is_list = mode == "TRIANGLES" || mode == "INDICES";
  const bool fits = is_attribute ? stride % 4 == 0 && stride <= 256 : stride == 2 || stride == 4;
  if (!(is_attribute || is_list) || !fits || stride == 0 || count == 0 || (mode == "TRIANGLES" && count % 3 != 0))
    refuse(fmt::format("is compressed by meshopt as {} elements of {} bytes in the mode '{}', which there is not",
                       count, stride, mode));
  std::string result(count * stride, '\0');
  const int failed = is_attribute ? meshopt_decodeVertexBuffer(result.data(), count, stride, start(bytes), bytes.size())
                     : mode == "TRIANGLES"
                         ? meshopt_decodeIndexBuffer(result.data(), count, stride, start(bytes), bytes.size())
                         : meshopt_decodeIndexSequence(result.data(), count, stride, start(bytes), bytes.size());
  if (failed) refuse("is compressed by meshopt, but damaged or of a later version; export without compression");
  if (filter.empty() || filter == "NONE") return result;
  if (filter == "OCTAHEDRAL" && (stride == 4 || stride == 8))
    meshopt_decodeFilterOct(result.data(), count, stride);
  else if (filter == "QUATERNION" && stride == 8)
    meshopt_decodeFilterQuat(result.data(), count, stride);
  else if (filter == "EXPONENTIAL")
    meshopt_decodeFilterExp(result.data(), count, stride);
  else
    refuse(fmt::format("is compressed by meshopt with the filter '{}' for {} bytes, which is not supported", filter,
                       stride));
  return result;
}
#else
std::string decode_meshopt(std::string_view, size_t, size_t, const std::string&, const std::string&) {
  refuse_missing("meshopt", "libmeshoptimizer-dev");
}
#endif

#ifdef COVARY_DRACO
namespace {

DracoMesh::Attribute values_of(const draco::Mesh& mesh, const draco::PointAttribute& given) {
  DracoMesh::Attribute attribute{given.num_components(), {}};
  const auto width = static_cast<size_t>(attribute.width);
  attribute.values.resize(mesh.num_points() * width);
  std::vector<double> element(width);
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    if (!given.ConvertValue<double>(given.mapped_index(point), static_cast<int8_t>(attribute.width), element.data()))
      refuse("has a Draco attribute without values");
    std::copy(element.begin(), element.end(), attribute.values.begin() + static_cast<ptrdiff_t>(point.value() * width));
  }
  return attribute;
}

}  // namespace

DracoMesh decode_draco(std::string_view bytes, const std::vector<int>& attributes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  std::unique_ptr<draco::Mesh> mesh;
  try {
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) refuse(fmt::format("is compressed by Draco, but damaged: {}", decoded.status().error_msg()));
    mesh = std::move(decoded).value();
  } catch (const std::bad_alloc&) {
    refuse("is compressed by Draco, but damaged: it claims more vertices than the memory holds");
  }
  DracoMesh result;
  result.n_vertices = mesh->num_points();
  for (draco::FaceIndex face(0); face < mesh->num_faces(); ++face)
    for (const draco::PointIndex& corner : mesh->face(face)) result.corners.push_back(corner.value());
  for (const int id : attributes) {
    const draco::PointAttribute* given = id < 0 ? nullptr : mesh->GetAttributeByUniqueId(static_cast<uint32_t>(id));
    if (!given) refuse(fmt::format("is compressed by Draco without the attribute {}", id));
    result.attributes[id] = values_of(*mesh, *given);
  }
  return result;
}
#else
DracoMesh decode_draco(std::string_view, const std::vector<int>&) { refuse_missing("Draco", "libdraco-dev"); }
#endif

bool is_webp(std::string_view bytes) {
  return bytes.size() > 12 && bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WEBP";
}

#ifdef COVARY_WEBP
bool reads_webp() { return true; }
WebpImage webp_size(std::string_view bytes) {
  WebpImage image;
  if (!WebPGetInfo(start(bytes), bytes.size(), &image.width, &image.height)) return {};
  return image;
}
WebpImage decode_webp(std::string_view bytes) {
  WebpImage image = webp_size(bytes);
  image.rgba.resize(static_cast<size_t>(image.width) * image.height * 4);
  if (!WebPDecodeRGBAInto(start(bytes), bytes.size(), image.rgba.data(), image.rgba.size(), image.width * 4))
    image.rgba.clear();
  return image;
}
#else
bool reads_webp() { return false; }
WebpImage webp_size(std::string_view) { return {}; }
WebpImage decode_webp(std::string_view) { return {}; }
#endif

}  // namespace covary
