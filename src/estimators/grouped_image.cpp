// SPDX-License-Identifier: Apache-2.0
#include "estimators/grouped_image.h"

#include <fmt/format.h>

#include "core/error.h"

namespace covary {

void throw_if_any(const std::string& name, const std::vector<std::string>& problems) {
  if (problems.empty()) return;
  std::string text = name + ": ";
  for (size_t i = 0; i < problems.size(); ++i) text += (i ? "; " : "") + problems[i];
  throw Error(ErrorCode::kUsage, text);
}

void check_inputs(const GroupedImage& crn, const GroupedImage& pt, int min_crn_groups, int min_pt_groups,
                  std::vector<std::string>& problems) {
  if (crn.width < 1 || crn.height < 1 || !crn.data) problems.push_back("the CRN image is empty");
  if (pt.width < 1 || pt.height < 1 || !pt.data) problems.push_back("the PT image is empty");
  if (crn.width != pt.width || crn.height != pt.height)
    problems.push_back(fmt::format("the CRN image is {} x {} and the PT image {} x {}; they must have the same size",
                                   crn.width, crn.height, pt.width, pt.height));
  if (crn.groups < min_crn_groups)
    problems.push_back(fmt::format("the CRN image has {} group{}, at least {} are needed (12 are recommended)",
                                   crn.groups, crn.groups == 1 ? "" : "s", min_crn_groups));
  if (pt.groups < min_pt_groups)
    problems.push_back(fmt::format("the PT image has {} group{}, at least {} are needed with these settings", pt.groups,
                                   pt.groups == 1 ? "" : "s", min_pt_groups));
}

}  // namespace covary
