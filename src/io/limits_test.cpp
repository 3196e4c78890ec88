// SPDX-License-Identifier: Apache-2.0
// Small files that expand to very much: each is rejected with a message stating the limit.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "io/load_scene.h"
#include "support/describe.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;
using test_support::TemporaryFolder;

const std::string kSensor = "<sensor type=\"perspective\"/>\n";

std::string scene(const std::string& body) { return "<scene version=\"3.0.0\">" + body + "</scene>"; }

std::string errors(const std::string& body, const std::string& name = "/no/such/scene.xml") {
  return message_of([&] { load_scene_text(scene(kSensor + body), name); });
}

/// `n` models of the type, each holding the previous one `times` times.
std::string chain(const std::string& type, int n, int times, const std::string& more = "") {
  std::string text = "<bsdf type=\"diffuse\" id=\"b0\"/>\n";
  for (int i = 1; i <= n; ++i) {
    text += fmt::format("<bsdf type=\"{}\" id=\"b{}\">{}", type, i, more);
    for (int k = 0; k < times; ++k) text += fmt::format("<ref id=\"b{}\"/>", i - 1);
    text += "</bsdf>\n";
  }
  return text + fmt::format("<shape type=\"sphere\"><ref id=\"b{}\"/></shape>", n);
}

const std::string kHalf = "<float name=\"weight\" value=\"0.5\"/>";

TEST(Limits, BlendsOfBlends) {
  EXPECT_EQ(errors(chain("blendbsdf", 8, 2, kHalf)), "no error");
  EXPECT_EQ(
      errors(chain("blendbsdf", 30, 2, kHalf)),
      "/no/such/scene.xml:14:1: bsdf 'blendbsdf' holds 8191 objects when every reference is followed; at most 4096 "
      "are accepted\n"
      "/no/such/scene.xml:26:1: bsdf 'blendbsdf' holds 8191 objects when every reference is followed; at most 4096 "
      "are accepted");
}

TEST(Limits, TwoSidedModelsHoldTheirModelTwice) {
  EXPECT_EQ(errors(chain("twosided", 10, 1)), "no error");
  EXPECT_TRUE(contains(errors(chain("twosided", 60, 1)), "bsdf 'twosided' holds 8191 objects when every reference is"));
}

TEST(Limits, ChainsOfReferences) {
  const std::string opaque = "<float name=\"opacity\" value=\"1\"/>";
  EXPECT_EQ(errors(chain("mask", 60, 1, opaque)), "no error");
  const std::string text = errors(chain("mask", 20000, 1, opaque));
  EXPECT_TRUE(contains(text,
                       "/no/such/scene.xml:66:1: bsdf 'mask' holds 65 objects inside each other when every "
                       "reference is followed; at most 64 are accepted"));
  EXPECT_TRUE(contains(text, "more errors"));
}

TEST(Limits, ChainsOfShapes) {
  std::string text = "<shape type=\"sphere\" id=\"s0\"/>\n";
  for (int i = 1; i < 20000; ++i)
    text += fmt::format("<shape type=\"sphere\" id=\"s{}\"><ref id=\"s{}\"/></shape>\n", i, i - 1);
  EXPECT_TRUE(contains(errors(text), "shape 'sphere' holds 65 objects inside each other"));
}

TEST(Limits, LargeGroupsAreNoChains) {
  std::string text = "<shape type=\"shapegroup\" id=\"g\">";
  for (int i = 0; i < 5000; ++i) text += "<shape type=\"sphere\"/>";
  text += "</shape>";
  for (int i = 0; i < 3; ++i) text += "<shape type=\"instance\"><ref id=\"g\"/></shape>";
  EXPECT_EQ(errors(text), "no error");
}

TEST(Limits, Includes) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("0.xml")) << scene("<shape type=\"sphere\"/>");
  for (int i = 1; i <= 6; ++i) {
    std::string body;
    for (int k = 0; k < 10; ++k) body += fmt::format("<include filename=\"{}.xml\"/>", i - 1);
    std::ofstream(folder.file(fmt::format("{}.xml", i))) << scene(body);
  }
  const std::string main = folder.file("scene.xml");
  EXPECT_EQ(errors("<include filename=\"2.xml\"/>", main), "no error");
  EXPECT_TRUE(contains(errors("<include filename=\"6.xml\"/>", main), "more than 1000 includes"));
}

TEST(Limits, Substitutions) {
  std::string text = "<default name=\"a\" value=\"0123456789abcdef\"/>";
  char name = 'a';
  for (int i = 0; i < 14; ++i, ++name)  // up to 2^18 characters
    text += fmt::format("<default name=\"{}\" value=\"${}${}\"/>", static_cast<char>(name + 1), name, name);
  for (int i = 0; i < 100; ++i) text += fmt::format("<bsdf type=\"diffuse\" id=\"{}${}\"/>", i, name);
  EXPECT_TRUE(contains(errors(text), "more than 16 MiB have been substituted for parameters of this scene"));
}

TEST(Limits, VersionsOfTheFormat) {
  for (const char* version : {"0.4.0", "2.0", "3.7.1"})
    EXPECT_EQ(message_of(
                  [&] { load_scene_text(fmt::format("<scene version=\"{}\">{}</scene>", version, kSensor), "s.xml"); }),
              "no error")
        << version;
  EXPECT_EQ(message_of([&] { load_scene_text("<scene version=\"99.0\">" + kSensor + "</scene>", "s.xml"); }),
            "s.xml:1:1: version '99.0' is not known; expected 0.x to 3.x");
}

TEST(Messages, AFileThatIsNoRegularFile) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo(folder.file("fifo").c_str(), 0600), 0);
  const std::string main = folder.file("scene.xml");
  const auto mesh = [](const std::string& file) {
    return "<shape type=\"ply\"><string name=\"filename\" value=\"" + file + "\"/></shape>";
  };
  EXPECT_EQ(errors(mesh("fifo"), main),
            main + ":2:19: '" + folder.file("fifo") + "' is a pipe or device; expected a regular file");
  EXPECT_EQ(errors(mesh("."), main), main + ":2:19: '" + folder.file(".") + "' is a folder; expected a regular file");
}

TEST(Messages, AGroupThatHoldsAnInstance) {
  EXPECT_EQ(errors("<shape type=\"shapegroup\" id=\"a\"><shape type=\"sphere\"/></shape>\n"
                   "<shape type=\"shapegroup\"><shape type=\"instance\"><ref id=\"a\"/></shape></shape>"),
            "/no/such/scene.xml:3:1: shape 'shapegroup': holds no shape\n"
            "/no/such/scene.xml:3:26: a shapegroup cannot hold a shape 'instance', only shapes that have a surface of "
            "their own");
}

}  // namespace
}  // namespace covary
