// SPDX-License-Identifier: Apache-2.0
// The parts of a paper as one page and as data.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lab/results.h"
#include "papers/paper.h"
#include "report/report.h"

namespace covary::lab {

/// What pages of several parts may hold, in values of images: 1.3 GB of HTML at most. Pictures beyond it are only on
/// the parts' own pages.
inline constexpr size_t kMaxPictureValues = 250'000'000;

/// Results of parts, joined as they are made.
class PaperReport {
 public:
  explicit PaperReport(const Paper& paper) : paper_(paper) {}

  /// Adds a part with its own document and pictures (report_document(), add_pictures()).
  void add(const PreparedPart& part, const Results& results, nlohmann::ordered_json document,
           std::vector<ReportImage> pictures);
  /// A table of all parts, then the parts with their sections.
  nlohmann::ordered_json document() const;
  const std::vector<ReportImage>& pictures() const { return pictures_; }
  /// {"format", "paper", "parts": [{"names", "title", "published", "missing", "own_scenes", "results"}]}
  nlohmann::ordered_json data() const;

 private:
  const Paper& paper_;
  nlohmann::ordered_json meta_, rows_ = nlohmann::ordered_json::array(), sections_ = nlohmann::ordered_json::array(),
                                parts_ = nlohmann::ordered_json::array();
  std::vector<ReportImage> pictures_;
  size_t picture_values_ = 0;
};

}  // namespace covary::lab
