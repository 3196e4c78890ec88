// SPDX-License-Identifier: Apache-2.0
// The fuzz targets without a fuzzer: a few thousand mutations of built-in files, the same in every run.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "fuzz/targets.h"

namespace covary {
namespace {

/// A stream of numbers; the key of input i is i.
class Dice {
 public:
  explicit Dice(uint64_t key) : key_(key) {}
  size_t below(size_t n) { return n == 0 ? 0 : static_cast<size_t>(mix64(combine64(key_, ++count_)) % n); }

 private:
  uint64_t key_, count_ = 0;
};

/// Changes `text` at a few places: bytes, lengths, order, and pieces that readers trip over.
std::string mutate(std::string text, const std::vector<std::string>& pieces, uint64_t key) {
  Dice dice(key);
  for (size_t n = 1 + dice.below(4); n > 0; --n) {
    const size_t at = dice.below(text.size() + 1), length = dice.below(std::min<size_t>(text.size() - at, 40) + 1);
    switch (dice.below(7)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << dice.below(8)));
        break;
      case 1:
        if (at < text.size()) text[at] = static_cast<char>(dice.below(256));
        break;
      case 2:
        text.erase(at, length);
        break;
      case 3:
        text.insert(at, text.substr(dice.below(text.size() + 1), length));
        break;
      case 4:
        text.resize(at);
        break;
      case 5:
        text.insert(at, pieces[dice.below(pieces.size())]);
        break;
      case 6: {  // a number for another
        const size_t digit = text.find_first_of("0123456789", at);
        if (digit == std::string::npos) break;
        const size_t end = std::min(text.find_first_not_of("0123456789.", digit), text.size());
        text.replace(digit, end - digit, pieces[dice.below(pieces.size())]);
        break;
      }
    }
  }
  return text;
}

const std::vector<std::string> kNumbers = {"0",     "-1",  "4294967295", "4294967296", "18446744073709551615", "1e999",
                                           "nan",   "inf", "1e-999",     "2147483648", "-2147483648",          "0x10",
                                           "1.5.2", " ",   "\n",         "3"};

/// Replays the seeds, which must be accepted, and `n` mutations of each. Some mutations must be
/// accepted and some rejected: otherwise they would not reach the reader's inner parts, or change nothing.
void replay(bool (*target)(fuzz::Bytes), const std::vector<std::string>& seeds, std::vector<std::string> pieces,
            int n) {
  pieces.insert(pieces.end(), kNumbers.begin(), kNumbers.end());
  int n_accepted = 0;
  for (const std::string& seed : seeds) {
    EXPECT_TRUE(target(std::as_bytes(std::span(seed))));
    for (int i = 0; i < n; ++i) {
      const std::string input = mutate(seed, pieces, static_cast<uint64_t>(i));
      SCOPED_TRACE("mutation " + std::to_string(i));
      ASSERT_NO_THROW(n_accepted += target(std::as_bytes(std::span(input))));
    }
  }
  EXPECT_GT(n_accepted, n / 100);
  EXPECT_LT(n_accepted, static_cast<int>(seeds.size()) * n * 9 / 10);
}

TEST(FuzzReplay, Scene) {
  const std::string scene = R"(<?xml version="1.0"?>
<scene version="3.0.0"><default name="n" value="4"/><integrator type="path"><integer name="max_depth" value="$n"/>
</integrator>
<sensor type="perspective"><float name="fov" value="40"/><transform name="to_world">
<lookat origin="0 0 5" target="0 0 0" up="0 1 0"/>
</transform><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
<rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="m"><bsdf type="roughconductor"><spectrum name="eta" value="400:1.5, 700:1.2"/>
<rgb name="k" value="3, 2, 1"/>
<float name="alpha" value="0.2"/></bsdf></bsdf><alias id="m" as="n"/>
<shape type="sphere"><point name="center" x="0" y="1" z="0"/><ref id="n"/></shape>
<shape type="cube"><transform name="to_world"><rotate y="1" angle="20"/><scale value="2"/><translate x="1"/></transform>
<bsdf type="plastic"><texture name="diffuse_reflectance" type="checkerboard"><rgb name="color0" value="#ff8000"/>
</texture></bsdf></shape>
<shape type="rectangle"><emitter type="area"><blackbody name="radiance" temperature="5000K" scale="0.001"/></emitter>
</shape>
<shape type="shapegroup" id="g"><shape type="disk"/></shape><shape type="instance"><ref id="g"/></shape></scene>)";
  const std::string old =
      R"(<scene version="0.6.0"><sensor type="thinlens"><float name="apertureRadius" value="0.1"/></sensor>
<bsdf type="diffuse" id="a"><srgb name="diffuseReflectance" value="0.5"/></bsdf><shape type="cylinder"><ref id="a"/>
<boolean name="flipNormals" value="true"/></shape><texture type="checkerboard"><float name="uscale" value="2"/>
</texture>
<emitter type="spot"><spectrum name="intensity" value="2"/></emitter></scene>)";
  replay(fuzz::scene, {scene, old},
         {"<ref id=\"m\"/>", "<ref id=\"g\"/>", "<bsdf type=\"mask\">", "</bsdf>", "$n", "\\$", "<scale value=\"0\"/>",
          "id=\"m\" ", "<!--", "type=\"instance\"", "&lt;", "<default name=\"n\" value=\"$n$n\"/>",
          "<shape type=\"sphere\">", "\"", ">", "<include filename=\"x.xml\"/>", "<path value=\".\"/>",
          "<texture type=\"bitmap\"><string name=\"filename\" value=\"x.png\"/></texture>"},
         2000);
}

TEST(FuzzReplay, Ply) {
  const std::string ascii =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n3 0 1 2\n";
  std::vector<std::string> seeds = {ascii};
  for (const bool big : {false, true}) {
    std::string text =
        std::string("ply\nformat binary_") + (big ? "big" : "little") +
        "_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
        "property float ny\nproperty float nz\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
    const auto append = [&](auto value) {
      char raw[sizeof(value)];
      std::memcpy(raw, &value, sizeof(value));
      if (big) std::reverse(raw, raw + sizeof(value));
      text.append(raw, sizeof(value));
    };
    for (const auto& p : {std::pair{0.f, 0.f}, {1.f, 0.f}, {0.f, 1.f}})
      for (float v : {p.first, p.second, 0.f, 0.f, 0.f, 1.f}) append(v);
    for (int i = 0; i < 2; ++i) {
      append(uint8_t{3});
      for (uint32_t k = 0; k < 3; ++k) append(k);
    }
    seeds.push_back(text);
  }
  replay(fuzz::ply, seeds,
         {"property list int int extra\n", "property double w\n", "element other 1000000\n", "end_header\n",
          "element face 7\n", "\xff\xff\xff\xff", "property list uchar float vertex_index\n", "big", "ascii"},
         2000);
}

TEST(FuzzReplay, Obj) {
  replay(
      fuzz::obj,
      {"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1 4/2/1\nf -1//-1 -2 -3/1\n"},
      {"f ", "v ", "vn ", "vt ", "/", "//", "f 1 1 1\n", "-9223372036854775808"}, 4000);
}

TEST(FuzzReplay, Serialized) {
  std::string body;
  const auto append = [&body](const auto& value) { body.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  append(uint32_t{0x1001});
  body += std::string("m") + '\0';
  append(uint64_t{3}), append(uint64_t{1});
  for (float v : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f}) append(v);
  for (uint32_t v : {0u, 1u, 2u}) append(v);
  // Both as mutations of the compressed file and, behind a stored (not compressed) block, of what is in it.
  std::vector<std::string> seeds;
  for (int level : {Z_BEST_COMPRESSION, Z_NO_COMPRESSION}) {
    uLongf size = compressBound(body.size());
    std::string packed(size, '\0');
    ASSERT_EQ(compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(body.data()),
                        body.size(), level),
              Z_OK);
    packed.resize(size);
    std::string file = std::string("\x1c\x04\x04\x00", 4) + packed;
    const std::string mesh = file;
    const uint64_t offsets[2] = {0, mesh.size()};
    file += mesh;
    file.append(reinterpret_cast<const char*>(offsets), sizeof(offsets));
    file += std::string("\x02\x00\x00\x00", 4);
    seeds.push_back(file);
  }
  replay(fuzz::serialized, seeds, {std::string("\xff\xff\xff\xff", 4), std::string(8, '\0'), "\x1c\x04"}, 2000);
}

/// The files of a target's corpus: where fuzzing starts, and every finding of before.
std::vector<std::string> corpus(const std::string& target) {
  std::vector<std::string> contents;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(COVARY_SOURCE_DIR "/tests/fuzz/corpus/") + target)) {
    std::ifstream file(entry.path(), std::ios::binary);
    contents.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return contents;
}

TEST(FuzzReplay, Corpora) {
  for (const fuzz::Target& target : fuzz::targets()) {
    SCOPED_TRACE(target.name);
    int n_accepted = 0;
    for (const std::string& input : corpus(target.name))
      ASSERT_NO_THROW(n_accepted += target.run(std::as_bytes(std::span(input))));
    EXPECT_GE(n_accepted, 1);
  }
}

/// The accepted files of a corpus and their mutations.
void replay_corpus(const char* name, const std::vector<std::string>& pieces, int n) {
  const auto targets = fuzz::targets();
  const auto target =
      std::find_if(targets.begin(), targets.end(), [&](const auto& t) { return t.name == std::string(name); });
  std::vector<std::string> seeds = corpus(name);
  std::erase_if(seeds, [&](const std::string& seed) { return !target->run(std::as_bytes(std::span(seed))); });
  std::sort(seeds.begin(), seeds.end());
  replay(target->run, seeds, pieces, n);
}

const std::vector<std::string> kExrPieces = {std::string(4, '\0'),       "\xff\xff\xff\xff",
                                             std::string("R\0", 2),      "group00.R",
                                             std::string("string\0", 7), std::string("tiledesc\0\x09\0\0\0", 13)};

TEST(FuzzReplay, Film) { replay_corpus("film", kExrPieces, 400); }
TEST(FuzzReplay, Grouped) { replay_corpus("grouped", kExrPieces, 400); }
TEST(FuzzReplay, Image) { replay_corpus("image", kExrPieces, 50); }
TEST(FuzzReplay, Pbrt) {
  replay_corpus("pbrt",
                {"[", "]", "\"", "#", "AttributeBegin", "ObjectEnd", "ObjectInstance \"ball\"", "Scale 0 0 0",
                 "\"float radius\"", "Include \"a.pbrt\"", "NamedMaterial \"gold\"", "Shape \"disk\"", "true"},
                2000);
}
TEST(FuzzReplay, Gltf) {
  replay_corpus("gltf",
                {"[", "{", "}", "null", "\"byteStride\":1,", "\"indices\":0,", "\"mode\":6,", "\"mesh\":0,",
                 "\"sparse\":{},", "\"uri\":\"a.bin\",", "\"children\":[0],", std::string(4, '\0'), "\xff\xff\xff\xff"},
                2000);
}
TEST(FuzzReplay, Tensor) {
  replay_corpus("tensor", {std::string(8, '\0'), std::string(8, '\xff'), std::string("\1\0\0\0\0\0\0\0", 8), "rgb"},
                2000);
}
TEST(FuzzReplay, Suite) {
  replay_corpus("suite", {"[", "{", "}", "null", "true", "\"seeds\": 4000000000,", "\"name\": \"a\",", "\\u0000", "{}"},
                2000);
}
TEST(FuzzReplay, Training) {
  replay_corpus("training", {std::string(4, '\0'), "\xff\xff\xff\xff", std::string("\1\0\0\0", 4), "covary"}, 2000);
}
TEST(FuzzReplay, Costs) { replay_corpus("costs", {"[", "{", "null", "\"rays\": 1,", "{}", "-", "\""}, 2000); }

}  // namespace
}  // namespace covary
