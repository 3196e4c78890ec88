// SPDX-License-Identifier: Apache-2.0
// One self-contained HTML page of tables, plots and an image comparer. The page knows nothing of methods or scenes: it
// draws a document, whose format docs/report.md describes, and the images that the document names.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// An image of the page: linear RGB, or numbers of 1 channel. The page holds it in half floats (11 significant bits,
/// finite values within ±65504), compressed without further loss, and decodes it when it is first shown.
struct ReportImage {
  std::string id;  ///< the document's name for it; unique
  Image pixels;
};

/// Writes the page to `path`; it appears under its name only when complete. Throws Error(kIo) when it cannot be written
/// and Error(kInternal) when the document has a block of unknown type or names an image that is not among `images`,
/// when two images share an id, or when an image has neither 1 nor 3 channels.
void write_report(const std::string& path, const nlohmann::ordered_json& document,
                  const std::vector<ReportImage>& images);

}  // namespace covary
