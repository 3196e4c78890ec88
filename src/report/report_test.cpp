// SPDX-License-Identifier: Apache-2.0
// The contents of the written file; tests/report opens it in a browser.
#include "report/report.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "support/files.h"

namespace covary {
namespace {

using Json = nlohmann::ordered_json;

class Report : public testing::Test {
 protected:
  std::string write(const Json& document, const std::vector<ReportImage>& images) {
    const std::string path = test_support::test_file("report.html");
    write_report(path, document, images);
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }

  static Json with_image(const std::string& id) {
    return {{"title", "t"},
            {"sections",
             {{{"id", "s"},
               {"blocks",
                {{{"type", "comparer"},
                  {"id", "c"},
                  {"scenes", {{{"name", "a"}, {"images", {{{"name", "n"}, {"image", id}}}}}}}}}}}}}};
  }
};

size_t count(const std::string& text, const std::string& what) {
  size_t n = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST_F(Report, HoldsTheLibraryItsLicenceAndNoAddressThatIsFetched) {
  const std::string page = write({{"title", "A & B"}}, {});
  EXPECT_NE(page.find("<title>A &amp; B</title>"), std::string::npos);
  EXPECT_NE(page.find("Chart.js v3"), std::string::npos);
  EXPECT_NE(page.find("Permission is hereby granted"), std::string::npos);
  EXPECT_EQ(page.find("{{"), std::string::npos) << "a placeholder was left";
  for (const char* fetched : {"src=\"http", "href=\"http", "@import", "url(http"})
    EXPECT_EQ(page.find(fetched), std::string::npos) << fetched;
}

TEST_F(Report, TextOfTheDocumentCannotEndItsScript) {
  const size_t plain = count(write({{"title", "t"}}, {}), "</script");
  EXPECT_EQ(count(write({{"title", "t"}, {"subtitle", "</script><!-- \xff"}}, {}), "</script"), plain);
}

TEST_F(Report, HoldsEveryImageOnce) {
  const std::string page = write(with_image("a\"b"), {{"a\"b", Image(3, 2, 3)}});
  EXPECT_EQ(count(page, "data-image=\"a&quot;b\""), 1u);
  EXPECT_NE(page.find("\"image_sizes\":{\"a\\\"b\":[3,2,3]}"), std::string::npos);
}

TEST_F(Report, RefusesDocumentsThatCannotBeDrawn) {
  EXPECT_THROW(write(with_image("missing"), {}), Error);
  EXPECT_THROW(write(with_image("a"), {{"a", Image(1, 1, 3)}, {"a", Image(1, 1, 3)}}), Error);
  EXPECT_THROW(write(with_image("a"), {{"a", Image(1, 1, 2)}}), Error);
  EXPECT_THROW(write({{"sections", {{{"id", "s"}, {"blocks", {{{"type", "chart"}}}}}}}}, {}), Error);
  EXPECT_FALSE(std::filesystem::exists(test_support::test_file("report.html")));
}

}  // namespace
}  // namespace covary
