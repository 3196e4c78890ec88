// SPDX-License-Identifier: Apache-2.0
// The tables and figures of a paper: parts, each a built-in suite with what was published. File format:
// docs/experiments.md.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "lab/overrides.h"
#include "lab/suite.h"

namespace covary::lab {

struct PaperPart {
  std::vector<std::string> names;      ///< "table1", "fig8": any of them chooses it; the first names its folder
  std::string title;                   ///< "Table 1 and Fig. 8: ten scenes"
  std::string suite;                   ///< name of a built-in suite
  double seconds = 0;                  ///< in place of the suite's budgets; 0: these
  std::vector<std::string> published;  ///< what the paper reports, and how this differs from the suite
  QuickLimits quick;
};

struct Paper {
  std::string name, title, description;
  std::string own_scenes;  ///< a built-in suite whose scenes replace those of a part of which none is at hand
  std::vector<PaperPart> parts;
};

/// Reads a paper. `name` is used as the file name in messages. Throws Error(kInput) listing all problems.
Paper parse_paper(const std::string& text, const std::string& name);

/// Text of each paper by name: suites/papers/*.json of the source tree.
const std::map<std::string, std::string_view>& builtin_papers();

/// A part as it will be run.
struct PreparedPart {
  PaperPart part;
  Suite suite;                      ///< scenes: those at hand, by absolute paths
  std::vector<SceneEntry> missing;  ///< scenes that are not
  bool own_scenes = false;          ///< none was
};

/// The chosen parts, all if `only` is empty, with scenes from `folder` (may be empty) or `own_folder`, that of the
/// program's own scenes. Names of scenes and methods in the overrides must exist in some part; parts that have none of
/// them are left out. Quick overrides get the limits of the part. Throws Error(kUsage) for unknown names, and if no
/// part is left.
std::vector<PreparedPart> prepare_parts(const Paper& paper, const std::vector<std::string>& only,
                                        const std::string& folder, const std::string& own_folder,
                                        const Overrides& overrides);

}  // namespace covary::lab
