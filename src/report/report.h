// SPDX-License-Identifier: Apache-2.0
// One self-contained HTML page with tables, plots and an image comparer. The page knows nothing about methods or
// scenes: it renders a document, whose format docs/report.md describes, and the images that the document names.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "film/film.h"

namespace covary {

/// An image of the page: linear RGB, or 1 channel of numbers. Stored as half floats (11 significant bits, finite values
/// within ±65504), losslessly compressed, and decoded when first shown.
struct ReportImage {
  std::string id;  ///< the document's name for it; unique
  Image pixels;
};

/// Writes the page to `path`, atomically. Throws Error(kIo) if it cannot be written and Error(kInternal) if the
/// document has a block of unknown type or names an image that is not among `images`, if two images share an id, or if
/// an image has neither 1 nor 3 channels.
void write_report(const std::string& path, const nlohmann::ordered_json& document,
                  const std::vector<ReportImage>& images);

/// The page without a document: it has the elements `head` and `content`, the comparer, tables and plots, and the names
/// of their scripts for `script`, which replaces page.js. `styles` follow those of a report.
std::string script_page(const std::string& title, std::string_view styles, std::string_view script);

}  // namespace covary
