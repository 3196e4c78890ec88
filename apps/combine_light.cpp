// SPDX-License-Identifier: Apache-2.0
#include "combine_light.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "estimators/light_film.h"

namespace covary {
namespace {

constexpr int kRows = 64;  // in memory at a time

}  // namespace

void check_light_files(const GroupedFile& crn, const GroupedFile& independent, const GroupedFile* light,
                       std::vector<Finding>& findings) {
  using Severity = Finding::Severity;
  for (const GroupedFile* file : {&crn, &independent}) {
    if (file->is_light_film())
      findings.push_back({Severity::kError, file->name() + " is a light film, which --light adds"});
    else if (light && file->has_light_added())
      findings.push_back({Severity::kError, file->name() + " has a light film added already"});
    else if (!light && !file->has_light_added() && file->settings().find("light_tracing=on") != std::string::npos)
      findings.push_back({Severity::kWarning, file->name() + " lacks the light of a light film; --light adds it"});
  }
  if (!light) return;
  if (!light->is_light_film())
    throw Error(ErrorCode::kInput, fmt::format("--light '{}' is no light film: it lacks the attribute "
                                               "covary:light_paths_per_sample",
                                               light->name()));
  if (!(light->place() == crn.place()))
    throw Error(ErrorCode::kInput, fmt::format("--light '{}' shows other pixels than '{}'", light->name(), crn.name()));
  if (!crn.scene_hash().empty() && light->scene_hash() != crn.scene_hash())
    findings.push_back({Severity::kError, "the light film says that it shows another scene (attribute scene_hash)"});
  if (!crn.settings().empty() && light->settings() != crn.settings())
    findings.push_back({Severity::kError, fmt::format("the light film says that it was rendered with '{}', the CRN "
                                                      "image with '{}'",
                                                      light->settings(), crn.settings())});
}

void add_light_file(const GroupedFile& light, EstimatorResult& result) {
  GroupedFile::Rows rows;
  for (int y = 0; y < light.height(); y += kRows) {
    const int n = std::min(kRows, light.height() - y);
    light.read_rows(y, n, rows);
    add_light(light.view(rows, n), result, y);
  }
}

}  // namespace covary
