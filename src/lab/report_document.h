// SPDX-License-Identifier: Apache-2.0
// Results as a document of tables, plots and a comparer, for write_report() (docs/report.md).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lab/results.h"
#include "report/report.h"

namespace covary::lab {

/// The document without pictures, which take time to read.
nlohmann::ordered_json report_document(const Results& results);

/// Appends the comparer to the document and its images to `images`: for each scene the reference (mean of its halves)
/// and the first seed of each method at the budget that the suite shows, each with its FLIP. It opens with
/// best_method() next to the baseline. Throws Error if an image cannot be read.
void add_pictures(const Results& results, nlohmann::ordered_json& document, std::vector<ReportImage>& images);

/// The method, other than the baseline, with the largest ratio to it at this budget (geometric mean over scenes; at
/// equal samples, or at equal time if the budget is in seconds). Empty if there is none.
std::string best_method(const Results& results, size_t budget);

/// A budget's conclusions in sentences: which method has the least error at equal samples (of a budget of time: at the
/// last budget of samples, if there is one), at equal time and by FLIP, and which are not clearly worse. Only counts
/// methods that have every scene.
std::vector<std::string> verdicts(const Results& results, size_t budget);

/// Index of the budget that pictures and single tables show: the suite's `show`, or the last.
size_t shown_budget(const Suite& suite);

}  // namespace covary::lab
