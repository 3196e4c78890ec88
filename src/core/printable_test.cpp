// SPDX-License-Identifier: Apache-2.0
#include "core/printable.h"

#include <gtest/gtest.h>

namespace covary::printable_test {
namespace {

TEST(Printable, EscapesWhatTerminalsObey) {
  EXPECT_EQ(printable("Gl\u00fchbirne, \u00b1 1\nnext"), "Gl\u00fchbirne, \u00b1 1\nnext");
  EXPECT_EQ(printable("\x1b[31mred\a\x7f\t"), "\\x1b[31mred\\x07\\x7f\\x09");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m\xc2"),
            "\\x9b31m\xc2");  // CSI of one character, and a text cut short
}

}  // namespace
}  // namespace covary::printable_test
