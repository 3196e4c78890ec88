// SPDX-License-Identifier: Apache-2.0
// Images of other programs: pixel types, windows, tiles, parts, layers; and damaged files.
#include "film/image_file.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfThreading.h>
#include <OpenEXR/ImfTiledRgbaFile.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "core/random.h"
#include "film/film_file.h"
#include "film/image_writer.h"
#include "imageio/image_io.h"
#include "imageio/png.h"
#include "support/files.h"

namespace covary {
namespace {

namespace Imf = OPENEXR_IMF_NAMESPACE;
using test_support::contains, test_support::message_of, test_support::test_file;

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

/// Values that are exact in half precision.
std::vector<Imf::Rgba> half_pixels(int width, int height) {
  std::vector<Imf::Rgba> pixels(static_cast<size_t>(width) * height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) pixels[y * width + x] = {half(x), half(y * 0.5f), half(100), half(1)};
  return pixels;
}

TEST(ImageFile, ReadsHalfWithAWindowAnywhere) {
  const std::string path = test_file("half.exr");
  const std::vector<Imf::Rgba> pixels = half_pixels(7, 5);
  {
    // Display window from (10, 20); the data window extends beyond it on the left.
    const Imath::Box2i display({10, 20}, {29, 39}), window({8, 22}, {14, 26});
    Imf::RgbaOutputFile file(path.c_str(), display, window, Imf::WRITE_RGBA);
    file.setFrameBuffer(pixels.data() - window.min.x - window.min.y * 7, 1, 7);
    file.writePixels(5);
  }
  const PlacedImage image = read_image(path);
  EXPECT_EQ(image.place, (ImagePlace{20, 20, {-2, 2, 7, 5}}));
  EXPECT_FALSE(image.low_dynamic_range);
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 7; ++x) ASSERT_EQ(image.image.rgb(x, y), Spectrum(x, y * 0.5f, 100));
  const ImageInfo info = inspect_image(path);
  EXPECT_EQ(info.format, "openexr");
  ASSERT_EQ(info.channels.size(), 4u);
  EXPECT_EQ(info.channels[0].name, "A");
  EXPECT_EQ(info.channels[0].type, "half");
}

TEST(ImageFile, ReadsTiles) {
  const std::string path = test_file("tiled.exr");
  const std::vector<Imf::Rgba> pixels = half_pixels(33, 17);
  {
    Imf::TiledRgbaOutputFile file(path.c_str(), 33, 17, 8, 8, Imf::ONE_LEVEL, Imf::ROUND_DOWN, Imf::WRITE_RGB);
    file.setFrameBuffer(pixels.data(), 1, 33);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  }
  const PlacedImage image = read_image(path);
  EXPECT_EQ(image.image.rgb(32, 16), Spectrum(32, 8, 100));
}

TEST(ImageFile, ReadsPartsAsLayers) {
  const std::string path = test_file("parts.exr");
  std::vector<Imf::Header> headers;
  for (const char* name : {"ambient", "depth"}) {
    Imf::Header header(4, 3);
    header.setName(name);
    header.setType(Imf::SCANLINEIMAGE);
    for (const char* channel : {"R", "G", "B"}) header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    headers.push_back(header);
  }
  {
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), 2);
    for (int part = 0; part < 2; ++part) {
      std::vector<float> values(12, 1.0f + part);
      Imf::FrameBuffer buffer;
      for (const char* channel : {"R", "G", "B"})
        buffer.insert(channel, Imf::Slice::Make(Imf::FLOAT, values.data(), headers[part].dataWindow()));
      Imf::OutputPart output(file, part);
      output.setFrameBuffer(buffer);
      output.writePixels(3);
    }
  }
  EXPECT_EQ(read_image(path, "depth").image.rgb(3, 2), Spectrum(2));
  EXPECT_EQ(read_image(path, "ambient").image.rgb(0, 0), Spectrum(1));
  EXPECT_TRUE(contains(message_of([&] { read_image(path); }),
                       "choose a layer by --layer (layers: ambient, depth; channels: ambient.B"));
}

TEST(ImageFile, RejectsDeepPixels) {
  const std::string path = test_file("deep.exr");
  {
    Imf::Header header(2, 2);
    header.setType(Imf::DEEPSCANLINE);
    header.compression() = Imf::ZIPS_COMPRESSION;
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    Imf::DeepScanLineOutputFile file(path.c_str(), header);
  }
  EXPECT_TRUE(contains(message_of([&] { inspect_image(path); }),
                       "deep.exr: no channels that can be read: Z (float, deep); render or flatten it"));
}

TEST(ImageFile, ChoosesLayers) {
  const std::vector<ExrFile::Channel> film{{"B", ""},         {"G", ""},      {"N.X", ""},       {"N.Y", ""},
                                           {"N.Z", ""},       {"R", ""},      {"group00.B", ""}, {"group00.G", ""},
                                           {"group00.R", ""}, {"samples", ""}};
  using Names = std::vector<std::string>;
  EXPECT_EQ(layer_channels("f", film, ""), (Names{"R", "G", "B"}));
  EXPECT_EQ(layer_channels("f", film, "N"), (Names{"N.X", "N.Y", "N.Z"}));
  EXPECT_EQ(layer_channels("f", film, "group00"), (Names{"group00.R", "group00.G", "group00.B"}));
  EXPECT_EQ(layer_channels("f", film, "samples"), (Names{"samples", "samples", "samples"}));
  EXPECT_TRUE(contains(message_of([&] { layer_channels("f.exr", film, "group01"); }),
                       "f.exr: no layer 'group01'; did you mean 'group00'? (layers: R G B, N, group00; channels: B G"));
  EXPECT_EQ(layer_channels("f", {{"Y", ""}}, ""), (Names{"Y", "Y", "Y"}));
  EXPECT_EQ(layer_channels("f", {{"v.r", ""}, {"v.g", ""}, {"v.b", ""}, {"depth", ""}}, ""),
            (Names{"v.r", "v.g", "v.b"}));
  // X Y Z without a layer name is a colour space and would be shown in wrong colours.
  EXPECT_TRUE(contains(message_of([] {
                         layer_channels("f", {{"X", ""}, {"Z", ""}, {"W", ""}}, "");
                       }),
                       "no channels R G B"));
}

TEST(ImageFile, SrgbRoundTrip) {
  for (int i = 0; i <= 255; ++i) {
    const float encoded = static_cast<float>(i) / 255;
    EXPECT_NEAR(linear_to_srgb(srgb_to_linear(encoded)), encoded, 1e-6);
  }
  EXPECT_NEAR(linear_to_srgb(0.5f), 0.735357f, 1e-6);  // 1.055 * 0.5^(1/2.4) - 0.055
}

/// Bytes are decoded by a table, to the same bits that OpenImageIO followed by srgb_to_linear() gives.
TEST(ImageFile, BytesAreDecodedAsFloatsAre) {
  std::vector<uint8_t> rgb(3 * 256);
  for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<uint8_t>(i);
  const std::vector<unsigned char> png = encode_png(256, 1, rgb, {});
  write(test_file("a.png"), std::string(png.begin(), png.end()));
  const std::vector<float> floats = open_image(test_file("a.png"))->read_floats(0, 3);
  const Image image = read_image(test_file("a.png")).image;
  for (size_t i = 0; i < floats.size(); ++i) EXPECT_EQ(image.data[i], srgb_to_linear(floats[i])) << i;
}

/// OpenEXR uses as many threads as the rest of the program may; one means the calling thread only.
TEST(ImageFile, ExrFilesUseTheThreadsThatAreAllowed) {
  const std::string path = test_file("a.exr");
  std::vector<float> values(64 * 64);
  const std::vector<ExrPlane> planes = {{"Y", ExrPlane::Type::kFloat, values.data(), 4}};
  for (const size_t n : {size_t{1}, size_t{3}, size_t{2}}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, n);
    write_exr(path, {64, 64, {0, 0, 64, 64}}, {}, planes);
    EXPECT_EQ(Imf::globalThreadCount(), n == 1 ? 0 : static_cast<int>(n));
  }
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
  const ExrFile file(path);
  EXPECT_EQ(Imf::globalThreadCount(), 0);
}

TEST(ImageFile, ReadsPortableFloatMaps) {
  std::string file = "PF\n2 2\n-1.0\n";
  for (float v : {7.0f, 8.0f, 9.0f, 0.0f, 0.0f, 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f})  // bottom row first
    file.append(reinterpret_cast<const char*>(&v), 4);
  write(test_file("a.pfm"), file);
  const PlacedImage image = read_image(test_file("a.pfm"));
  EXPECT_FALSE(image.low_dynamic_range);
  EXPECT_EQ(image.image.rgb(0, 0), Spectrum(1, 2, 3));
  EXPECT_EQ(image.image.rgb(1, 0), Spectrum(4, 5, 6));
  EXPECT_EQ(image.image.rgb(0, 1), Spectrum(7, 8, 9));
}

TEST(ImageFile, SaysWhyItCannotRead) {
  EXPECT_TRUE(contains(message_of([] { read_image("/nowhere.exr"); }), "cannot read /nowhere.exr: No such file"));
  EXPECT_TRUE(contains(message_of([] { read_image("/"); }), "cannot read /: it is a folder"));
  write(test_file("empty.exr"), "");
  EXPECT_TRUE(contains(message_of([] { read_image(test_file("empty.exr")); }), "the file is empty"));
  write(test_file("text.exr"), "not an image at all");
  EXPECT_TRUE(contains(message_of([] { read_image(test_file("text.exr")); }), "not an image that can be read"));
  EXPECT_TRUE(contains(message_of([] { read_film(test_file("text.exr")); }), "text.exr: not an EXR file"));
  write_png(test_file("a.png"), Image(2, 2, 3));
  EXPECT_TRUE(contains(message_of([] { read_film(test_file("a.png")); }), "a.png: not an EXR file"));
}

Film small_film() {
  Film film(20, 20, {2, 2, 16, 16}, 2);
  film.attributes[film_key::kSeed] = "1";
  for (size_t i = 0; i < film.data().size(); ++i) film.data()[i] = static_cast<float>((i * 2654435761u) % 1009);
  return film;
}

TEST(FilmFile, RejectsFilesThatAreNoFilms) {
  const std::string path = test_file("f.exr");
  const auto message = [&] { return message_of([&] { read_film(path); }); };
  std::vector<float> values(4);
  std::vector<uint32_t> counts(4, 3);
  const ImagePlace place{2, 2, {0, 0, 2, 2}};
  std::vector<ExrPlane> planes;
  for (const char* name : {"R", "G", "B"}) planes.push_back({name, ExrPlane::Type::kFloat, values.data(), 4});
  write_exr(path, place, {}, planes);
  EXPECT_TRUE(contains(message(), "not a film of covary (attribute covary:film is missing)"));
  write_exr(path, place, {{"covary:film", "9"}}, planes);
  EXPECT_TRUE(contains(message(), "film format '9'; this version reads '1'"));
  for (const char* groups : {"", "0", "-1", "1025", "two", "99999999999"}) {
    write_exr(path, place, {{"covary:film", "1"}, {"covary:groups", groups}}, planes);
    EXPECT_TRUE(contains(message(), std::string("covary:groups is '") + groups + "'; expected 1 to 1024"));
  }
  write_exr(path, place, {{"covary:film", "1"}, {"covary:groups", "1"}}, planes);
  EXPECT_TRUE(contains(message(), "channel samples of a film with 1 groups is missing"));
  planes.push_back({"samples", ExrPlane::Type::kFloat, values.data(), 4});
  write_exr(path, place, {{"covary:film", "1"}, {"covary:groups", "1"}}, planes);
  EXPECT_TRUE(contains(message(), "channel samples is of type float; expected uint"));
  planes.back() = {"samples", ExrPlane::Type::kUint, counts.data(), 4};
  write_exr(path, place, {{"covary:film", "1"}, {"covary:groups", "1"}}, planes);
  EXPECT_EQ(message(), "no error");
  write_exr(path, place, {{"covary:film", "1"}, {"covary:groups", "2"}}, planes);
  EXPECT_TRUE(contains(message(), "channel group01.R of a film with 2 groups is missing"));
  planes.push_back({"depth", ExrPlane::Type::kFloat, values.data(), 4});
  write_exr(path, place, {{"covary:film", "1"}, {"covary:groups", "1"}}, planes);
  EXPECT_TRUE(contains(message(), "channel depth does not belong to a film with 1 groups"));
  planes.pop_back();
  for (const char* name : {"group00.R", "group00.G", "group00.B", "group01.R", "group01.G", "group01.B"})
    planes.push_back({name, ExrPlane::Type::kFloat, values.data(), 4});
  write_exr(path, place, {{"covary:film", "1"}, {"covary:groups", "2"}}, planes);
  EXPECT_EQ(message(), "no error") << "groups may have different sizes";
}

// The file truncated to every length, or with random bytes changed, gives the film or an Error, never anything else.
TEST(FilmFile, DamagedFilesAreErrors) {
  const std::string path = test_file("f.exr"), damaged = test_file("d.exr");
  write_film(path, small_film());
  const std::string whole = content(path);
  for (size_t size = 0; size < whole.size(); size += size < 1500 ? 7 : 101) {
    write(damaged, whole.substr(0, size));
    ASSERT_TRUE(contains(message_of([&] { read_film(damaged); }), damaged)) << size;
  }
  int n_errors = 0;
  for (uint64_t i = 0; i < 600; ++i) {
    std::string changed = whole;
    for (uint32_t k = 0; k < 1 + i % 3; ++k) {
      const PathRandom random(Sampling::kIndependent, 1, 0, i, k);
      // Half of the changes hit the header.
      const size_t range = i % 2 ? whole.size() : std::min<size_t>(whole.size(), 1000);
      changed[static_cast<size_t>(random.get_1d(0, Event::kPixel) * range)] ^=
          static_cast<char>(1 + 254 * random.get_1d(0, Event::kLens));
    }
    write(damaged, changed);
    if (message_of([&] { read_film(damaged); }) != "no error") ++n_errors;
  }
  EXPECT_GT(n_errors, 400);
}

// A header that declares 200 000 x 200 000 pixels must not make the reader allocate them.
TEST(FilmFile, AbsurdSizesAreErrors) {
  const std::string path = test_file("f.exr");
  write_film(path, small_film());
  std::string file = content(path);
  const auto set = [&](const std::string& attribute, size_t offset, int32_t value) {
    const size_t at = file.find(attribute);
    ASSERT_NE(at, std::string::npos);
    file.replace(at + attribute.size() + 4 + offset, 4, reinterpret_cast<const char*>(&value), 4);
  };
  const std::string display("displayWindow\0box2i\0", 20), data("dataWindow\0box2i\0", 17);
  for (int32_t size : {200000, 2000000, 2147483647}) {
    for (size_t offset : {8, 12}) {
      set(display, offset, size - 1);
      set(data, offset, size - 1);
    }
    write(path, file);
    EXPECT_TRUE(contains(message_of([&] { read_film(path); }), path)) << size;
  }
  for (size_t offset : {8, 12}) set(data, offset, -5);  // ends before it begins
  write(path, file);
  EXPECT_TRUE(contains(message_of([&] { read_film(path); }), path));
}

TEST(ImageLayers, AreTriplesAndSingleChannels) {
  const std::vector<ExrFile::Channel> channels{{"B", "half"},   {"G", "half"},   {"R", "half"},   {"A", "half"},
                                               {"N.X", "half"}, {"N.Y", "half"}, {"N.Z", "half"}, {"depth.Z", "float"}};
  EXPECT_EQ(image_layers(channels), (std::vector<std::string>{"", "N", "A", "depth.Z"}));
}

/// A file of 1 x 1 pixels with these float channels of value 0.25, 0.5, …
void write_pixel(const std::string& path, const std::vector<std::string>& channels, const Imf::Header& like) {
  Imf::Header header = like;
  header.dataWindow() = header.displayWindow() = Imath::Box2i({0, 0}, {0, 0});
  std::vector<float> values;
  for (size_t i = 0; i < channels.size(); ++i) values.push_back(0.25f * static_cast<float>(i + 1));
  Imf::FrameBuffer buffer;
  for (size_t i = 0; i < channels.size(); ++i) {
    header.channels().insert(channels[i], Imf::Channel(Imf::FLOAT));
    buffer.insert(channels[i], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&values[i]), 4, 4));
  }
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(buffer);
  file.writePixels(1);
}

TEST(ImageFile, ColoursHaveASpaceAndVectorsHaveNone) {
  const std::string path = test_file("a.exr");
  Imf::Header header;
  header.insert("acesImageContainerFlag", Imf::IntAttribute(1));
  write_pixel(path, {"R", "G", "B", "N.R", "N.G", "N.B"}, header);
  EXPECT_EQ(inspect_image(path).colours.text(), "ACES2065-1");
  const auto rgb = [](const Image& image) { return image.rgb(0, 0); };
  // ACES2065-1 to Rec. 709 with Bradford's adaptation, as in OpenColorIO's ACES configurations.
  const Spectrum converted = rgb(read_image(path).image), stored(0.25f, 0.5f, 0.75f);
  EXPECT_NEAR(converted.r, 2.52169 * 0.25 - 1.13413 * 0.5 - 0.38756 * 0.75, 2e-5);
  EXPECT_NEAR(converted.g, -0.27648 * 0.25 + 1.37272 * 0.5 - 0.09624 * 0.75, 2e-5);
  EXPECT_NEAR(converted.b, -0.01538 * 0.25 - 0.15298 * 0.5 + 1.16835 * 0.75, 2e-5);
  EXPECT_EQ(rgb(read_image(path, "", ChecksumPolicy::kCheck, std::nullopt).image), stored);
  EXPECT_EQ(rgb(read_image(path, "N").image), Spectrum(1, 1.25f, 1.5f)) << "normals";
  EXPECT_EQ(rgb(read_layers(path, std::vector<std::string>{"", "N"})[0]), converted);

  // Chromaticities go before the flag.
  Imf::addChromaticities(header, Imf::Chromaticities());
  write_pixel(path, {"R", "G", "B"}, header);
  EXPECT_EQ(rgb(read_image(path).image), stored);
}

TEST(ImageFile, ThreeNamelessComponentsAreXyzOrAVector) {
  const std::string path = test_file("a.exr");
  write_pixel(path, {"X", "Y", "Z"}, {});
  EXPECT_EQ(read_image(path, "", ChecksumPolicy::kCheck, std::nullopt).image.rgb(0, 0), Spectrum(0.25f, 0.5f, 0.75f));
  // As colours, CIE XYZ: the inverse of the matrix in IEC 61966-2-1.
  const Spectrum rgb = read_image(path).image.rgb(0, 0);
  EXPECT_NEAR(rgb.r, 3.2406 * 0.25 - 1.5372 * 0.5 - 0.4986 * 0.75, 4e-4);
  EXPECT_NEAR(rgb.g, -0.9689 * 0.25 + 1.8758 * 0.5 + 0.0415 * 0.75, 4e-4);
  EXPECT_NEAR(rgb.b, 0.0557 * 0.25 - 0.2040 * 0.5 + 1.0570 * 0.75, 4e-4);
}

TEST(ImageFile, LuminanceAndChromaAreNoGreyPicture) {
  const std::string path = test_file("a.exr");
  write_pixel(path, {"Y", "RY", "BY"}, {});
  EXPECT_TRUE(contains(message_of([&] { read_image(path); }, ErrorCode::kInput),
                       "luminance and chroma of full resolution (channels Y, RY, BY); save the picture as R, G and B"));
}

}  // namespace
}  // namespace covary
