// SPDX-License-Identifier: Apache-2.0
#include "version.h"

#include "commit.h"

namespace covary {

std::string version_text() {
  const std::string commit = COVARY_COMMIT;
  return commit == "unknown" ? COVARY_VERSION : COVARY_VERSION " (" + commit + ")";
}

}  // namespace covary
