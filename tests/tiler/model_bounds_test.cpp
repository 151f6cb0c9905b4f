#include <fmt/format.h>
#include <gtest/gtest.h>
#include <libdeflate.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "core/image_io.h"
#include "core/stop.h"
#include "tests/support/expect_error.h"
#include "tests/support/peak_memory.h"
#include "tests/support/test_data.h"
#include "tests/tiler/vector_files.h"
#include "tiler/objects/model_file.h"
#include "tiler/objects/model_texture.h"
#include "tiler/objects/obj_check.h"

/// Models that would take minutes, or more memory than there is, are refused at once.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::ObjCheck;

tiler::Model read(const std::filesystem::path& file,
                  std::uint64_t texture_bytes_left = world::kMaxTexturesBytes) {
  tiler::ModelOptions options;
  options.name = "thing";
  options.file = {.written = file.filename().string(), .resolved = file};
  return tiler::read_model(options, texture_bytes_left);
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}
std::string repeated(std::uint64_t number, const std::function<std::string(std::uint64_t)>& line) {
  std::string text;
  for (std::uint64_t i = 0; i < number; ++i) text += line(i);
  return text;
}
const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// What takes seconds a thousand lines is refused within this, on a machine that is busy, too.
constexpr std::chrono::seconds kAtOnce(20);

/// Reading is refused, and that quickly.
void expect_quick_refusal(const std::filesystem::path& file,
                          const std::vector<std::string>& words) {
  const auto start = std::chrono::steady_clock::now();
  expect_error(ErrorKind::Input, words, [&] { read(file); });
  EXPECT_LT(std::chrono::steady_clock::now() - start, kAtOnce);
}

TEST(ModelBounds, ObjOfVeryManyMaterialsOrObjectsAreRefusedAtOnce) {
  const ScratchFolder folder;
  constexpr std::uint64_t kMaterials = 60'000;
  const auto face_of = [](std::uint64_t i) { return fmt::format("usemtl m{}\nf 1 2 3\n", i); };
  // 2026-11: 60 000 of them took assimp minutes, in which it heard of no signal.
  write_text(folder / "materials.obj", kCorners + repeated(kMaterials, face_of));
  // The first of them stands on line 4, each takes two.
  expect_quick_refusal(folder / "materials.obj",
                       {"materials.obj", fmt::format("line {}", 4 + 2 * ObjCheck::kMostChanges),
                        fmt::format("more than {} changes of material", ObjCheck::kMostChanges)});
  write_text(folder / "many.mtl",
             repeated(kMaterials, [](std::uint64_t i) { return fmt::format("newmtl m{}\n", i); }));
  write_text(folder / "library.obj", "mtllib many.mtl\n" + kCorners + "usemtl m1\nf 1 2 3\n");
  expect_quick_refusal(folder / "library.obj",
                       {"many.mtl", fmt::format("line {}", ObjCheck::kMostMaterials + 1),
                        fmt::format("more than {} materials", ObjCheck::kMostMaterials)});
  for (const char* kind : {"o", "g"}) {
    SCOPED_TRACE(kind);
    write_text(folder / "parts.obj", kCorners + repeated(100'000, [&](std::uint64_t i) {
                                       return fmt::format("{} part{}\nf 1 2 3\n", kind, i);
                                     }));
    expect_quick_refusal(folder / "parts.obj", {"parts.obj", "groups and objects",
                                                fmt::format("{}", ObjCheck::kMostParts)});
  }
  // As it is at the bounds it is read.
  write_text(folder / "some.obj", kCorners + repeated(2000, face_of));
  EXPECT_EQ(read(folder / "some.obj").prototype.levels[0].shape.triangles.size(), 2000U);
}

/// The check's own answer to a text, and to the same with one line more.
void expect_bound(const std::string& within, const std::string& more,
                  const std::vector<std::string>& words) {
  ObjCheck("a.obj").look_at_model(bytes_of(within));
  expect_error(ErrorKind::Input, words,
               [&] { ObjCheck("a.obj").look_at_model(bytes_of(within + more)); });
}

TEST(ModelBounds, ObjAreReadUpToEachBound) {
  const auto numbered = [](const char* form) {
    return [form](std::uint64_t i) { return fmt::format(fmt::runtime(form), i); };
  };
  expect_bound(repeated(ObjCheck::kMostParts, numbered("g {}\n")), "o x\n",
               {"a.obj: line 20001", "20000 groups"});
  expect_bound(repeated(ObjCheck::kMostChanges, numbered("usemtl {0}\nusemtl {0}\n")), "usemtl x\n",
               {"a.obj: line 40001", "20000 changes"});
  expect_bound(repeated(ObjCheck::kMostParts, numbered("mtllib {}\n")), "mtllib x\n",
               {"a.obj: line 20001", "20000 libraries"});
  // A model that names itself as its library.
  expect_bound(repeated(ObjCheck::kMostMaterials, numbered("newmtl {}\n")), "newmtl x\n",
               {"a.obj: line 10001", "10000 materials"});
  const std::string long_line(ObjCheck::kMostLineBytes, '#');
  expect_bound(long_line + "\r\n" + long_line, "#", {"a.obj: line 2", "1048576 bytes"});
  // A backslash joins lines.
  std::string joined;
  for (int i = 0; i < 16; ++i) joined += std::string(65535, 'x') + "\\\n";
  expect_bound(joined, "#", {"a.obj: line 17", "1048576 bytes"});
  std::string face = "f";
  for (int i = 0; i < 1000; ++i) face += i % 100 == 99 ? " \\\n 1" : " 1";
  expect_bound("f 1 2 3\n" + face, " 1",
               {"a.obj: line 12", "face 1 has 1001 corners", "at most 1000"});
  // Two million triangles in faces of 1000 corners, and lines.
  const std::string fan = "f" + repeated(1000, numbered(" {}")) + "\n";
  const std::string full = repeated(2004, [&](std::uint64_t) { return fan; });  // 998 each
  expect_bound(full + repeated(8, [](std::uint64_t) { return "f 1 2 3\n"; }), "f 1 2 3\n",
               {"a.obj: line 2013", "2000000 triangles"});
  const std::string line = "l" + repeated(10'000, [](std::uint64_t) { return " 1"; }) + "\n";
  expect_bound(repeated(600, [&](std::uint64_t) { return line; }), "p 1\n",
               {"a.obj: line 601", "6000000 corners"});
  expect_bound(repeated(18'000'000, [](std::uint64_t) { return "v\n"; }), "vt\n",
               {"a.obj: line 18000001", "18000000 vertices"});
}

TEST(ModelBounds, LibrariesCountOnceAndTheirBytesEachTime) {
  ObjCheck check("a.obj");
  const std::string materials = repeated(
      ObjCheck::kMostMaterials, [](std::uint64_t i) { return fmt::format("newmtl {}\n", i); });
  for (int i = 0; i < 3; ++i) check.look_at_library(bytes_of(materials), "a.mtl");
  expect_error(ErrorKind::Input, {"b.mtl: line 1", "10000 materials"},
               [&] { check.look_at_library(bytes_of("newmtl a\n"), "b.mtl"); });
  const std::string large(ObjCheck::kMostLibraryBytes / 2, '#');
  ObjCheck other("a.obj");
  for (int i = 0; i < 2; ++i) other.look_at_library(bytes_of(large), "a.mtl");
  expect_error(ErrorKind::Input, {"a.obj", "67108864 bytes", "a.mtl once"},
               [&] { other.look_at_library(bytes_of("#"), "a.mtl"); });
}

/// 2026-11: a read went on for minutes after SIGTERM.
TEST(ModelBounds, ReadingEndsWhereAStopIsAskedFor) {
  const ScratchFolder folder;
  const std::vector<std::pair<std::string, std::string>> files = {
      {"a.obj", kCorners + "f 1 2 3\n"},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
       "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 "
       "0\n2 0 1\n3 0 1 2\n"}};
  for (const auto& [name, text] : files) {
    SCOPED_TRACE(name);
    write_text(folder / name, text);
    read(folder / name);
    core::ask_to_stop();
    expect_error(ErrorKind::Interrupted, {}, [&] { read(folder / name); });
    core::forget_stop();
  }
}

std::vector<std::byte> zipped(const std::vector<std::uint8_t>& bytes) {
  libdeflate_compressor* compressor = libdeflate_alloc_compressor(12);
  std::vector<std::byte> out(libdeflate_zlib_compress_bound(compressor, bytes.size()));
  out.resize(
      libdeflate_zlib_compress(compressor, bytes.data(), bytes.size(), out.data(), out.size()));
  libdeflate_free_compressor(compressor);
  return out;
}

/// A PNG of so many pixels, all 0, in a thousandth of their bytes.
std::string black_png(std::uint32_t width, std::uint32_t height) {
  std::string png("\x89PNG\r\n\x1a\n", 8);
  const auto number = [](std::uint32_t value) {
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(value >> shift & 255U);
    return text;
  };
  const auto put = [&](const std::string& type, const std::string& data) {
    const std::string checked = type + data;
    png += number(static_cast<std::uint32_t>(data.size())) + checked +
           number(libdeflate_crc32(0, checked.data(), checked.size()));
  };
  put("IHDR", number(width) + number(height) + std::string("\x08\x06\0\0\0", 5));
  const std::vector<std::byte> data =
      zipped(std::vector<std::uint8_t>((4 * std::size_t{width} + 1) * height));
  put("IDAT", std::string(reinterpret_cast<const char*>(data.data()), data.size()));
  put("IEND", "");
  return png;
}

TEST(ModelBounds, TexturesTakeNoMoreMemoryThanIsLeftForThem) {
  const ScratchFolder folder;
  constexpr int kTextures = 40;
  // 16 MB each, and a third more for its coarser levels.
  const std::string png = black_png(2048, 2048);
  EXPECT_LT(png.size(), 20'000U);
  std::string materials;
  std::string model = "mtllib a.mtl\n" + kCorners + "vt 0 0\n";
  for (int i = 0; i < kTextures; ++i) {
    write_text(folder / fmt::format("{}.png", i), png);
    materials += fmt::format("newmtl m{0}\nmap_Kd {0}.png\n", i);
    model += fmt::format("usemtl m{}\nf 1/1 2/1 3/1\n", i);
  }
  write_text(folder / "a.mtl", materials);
  write_text(folder / "a.obj", model);
  const std::uint64_t one = world::mip_bytes(2048, 2048, 4);
  const PeakMemory peak;
  expect_error(ErrorKind::Input,
               {"a.obj: texture 3.png", "2048 x 2048", fmt::format("{}", one),
                fmt::format("{} are left", one - 1)},
               [&] { read(folder / "a.obj", 4 * one - 1); });
  // Three are kept and one is on its way, of the file's bytes and twice as pixels.
  EXPECT_LT(peak.more_mb(), 6 * 16.0 + 32.0);
  std::uint64_t left = 40 * one;
  std::vector<std::byte> bytes(png.size());
  std::copy_n(reinterpret_cast<const std::byte*>(png.data()), png.size(), bytes.begin());
  tiler::decode_texture(bytes, "a", left);
  EXPECT_EQ(left, 39 * one);
}

}  // namespace
}  // namespace terracast::test
