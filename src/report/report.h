// SPDX-License-Identifier: Apache-2.0
// One self-contained HTML page of tables, plots and an image comparer. The page knows nothing of methods or scenes: it
// draws a document, whose format docs/report.md describes, and the images that the document names.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// An image of the page: linear RGB, 3 channels. The page holds it in half floats (11 significant bits, finite values
/// within ±65504), compressed without further loss, and decodes it when it is first shown.
struct ReportImage {
  std::string id;  ///< the document's name for it; unique
  Image rgb;
};

/// Writes the page to `path`; it appears under its name only when complete. Throws Error(kIo) when it cannot be written
/// and Error(kInternal) when the document has a block of unknown type, names an image that is not among `images`, or
/// when two images share an id.
void write_report(const std::string& path, const nlohmann::ordered_json& document,
                  const std::vector<ReportImage>& images);

}  // namespace covary
