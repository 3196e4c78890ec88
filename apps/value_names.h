// SPDX-License-Identifier: Apache-2.0
// Placeholders in the help for options whose text names something outside the command. A suite may not use such options
// (suite_words.h), nor any whose placeholder is CLI11's "TEXT".
#pragma once

#include "settings/option.h"

namespace covary {

inline constexpr const char *kFileValue = "FILE", *kFolderValue = "FOLDER", *kLibraryValue = "LIBRARY",
                            *kServerValue = "HOST:PORT";

/// The placeholder of a declared option; null for a value.
constexpr const char* value_name_of(OptionNames names) {
  switch (names) {
    case OptionNames::kValue:
      return nullptr;
    case OptionNames::kFile:
      return kFileValue;
    case OptionNames::kFolder:
      return kFolderValue;
    case OptionNames::kLibrary:
      return kLibraryValue;
    case OptionNames::kServer:
      return kServerValue;
  }
  return "TEXT";
}

}  // namespace covary
