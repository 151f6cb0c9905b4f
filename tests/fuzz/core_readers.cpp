// JSON, TOML, ledgers, PNG, EXR and NumPy's arrays.

#include <array>
#include <string>
#include <vector>

#include "core/deflate.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/ledger.h"
#include "core/npz.h"
#include "core/toml_reader.h"
#include "rigs/rig.h"
#include "tests/fuzz/scratch.h"
#include "tiler/world_options.h"
#include "validate/npy.h"

namespace terracast::fuzz {
namespace {

/// More pixels take longer than they find.
constexpr std::size_t kMostPixels = std::size_t{1} << 16;

/// CRC-32 of PNG's chunks.
std::uint32_t crc_of(Bytes bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const std::byte byte : bytes) {
    crc ^= std::to_integer<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

void append_big_endian(std::vector<std::byte>& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8)
    out.push_back(static_cast<std::byte>(value >> shift));
}

void append_chunk(std::vector<std::byte>& png, std::string_view type, Bytes content) {
  append_big_endian(png, static_cast<std::uint32_t>(content.size()));
  const std::size_t hashed_from = png.size();
  for (const std::byte byte : bytes_of(type)) png.push_back(byte);
  png.insert(png.end(), content.begin(), content.end());
  append_big_endian(png, crc_of(std::span(png).subspan(hashed_from)));
}

void read_arrays(const std::map<std::string, validate::NpyArray>& arrays) {
  for (const auto& [name, array] : arrays) {
    if (array.num_values() * array.item_size != array.bytes.size())
      core::fail(core::ErrorKind::Internal, "{}: {} values of {} bytes in {}", name,
                 array.num_values(), array.item_size, array.bytes.size());
    if (array.kind == 'f' && array.item_size == 4)
      array.floats(name);
    else
      array.flags(name);
  }
}

}  // namespace

/// What is read is written so that it reads back to the same text.
void fuzz_json(Bytes input) {
  const core::Json json = core::Json::parse(text_of(input), "fuzz.json");
  const std::string text = json.text();
  if (core::Json::parse(text, "again.json").text() != text)
    core::fail(core::ErrorKind::Internal, "reads back to another text: {}", text);
}

void fuzz_ledger(Bytes input) {
  const core::Ledger ledger = core::Ledger::of(core::Json::parse(text_of(input), "fuzz.json"));
  ledger.warnings();
  ledger.table();
  if (!(core::Ledger::of(ledger.json()) == ledger))
    core::fail(core::ErrorKind::Internal, "reads back to another ledger: {}", ledger.json().text());
}

void fuzz_toml(Bytes input) {
  const core::TomlDocument document = core::TomlDocument::parse(text_of(input), "fuzz.toml");
  document.inputs();
  tiler::WorldOptions world;
  document.read(world);
}

void fuzz_rig_toml(Bytes input) {
  rigs::RigOptions rig;
  core::TomlDocument::parse(text_of(input), "fuzz.toml").read(rig);
  rigs::build_cameras({rig});
}

void fuzz_png(Bytes input) { core::decode_png(input, "fuzz.png", kMostPixels); }

/// A header of bytes, chunks beside the pixels, then the pixels' rows with their filters: the input needs neither
/// checksums nor deflate.
void fuzz_png_pixels(Bytes input) {
  Front front(input);
  std::vector<std::byte> png;
  for (const std::byte byte : bytes_of("\x89PNG\r\n\x1a\n")) png.push_back(byte);
  std::vector<std::byte> header;
  append_big_endian(header, static_cast<std::uint32_t>(front.number(2)));
  append_big_endian(header, static_cast<std::uint32_t>(front.number(2)));
  for (const std::byte byte : front.take(5)) header.push_back(byte);
  append_chunk(png, "IHDR", header);
  constexpr std::array<std::string_view, 8> kTypes = {"PLTE", "tRNS", "gAMA", "sBIT",
                                                      "bKGD", "iCCP", "zTXt", "acTL"};
  for (std::uint64_t left = front.number(1) % 8; left > 0; --left) {
    const std::string_view type = kTypes[front.number(1) % kTypes.size()];
    append_chunk(png, type, front.take(front.number(2)));
  }
  append_chunk(png, "IDAT", core::zlib_deflated(front.rest(), 1));
  append_chunk(png, "IEND", {});
  core::decode_png(png, "fuzz.png", kMostPixels);
}

void fuzz_exr(Bytes input) { core::decode_exr(input, "fuzz.exr", kMostPixels); }

void fuzz_npy(Bytes input) { read_arrays({{"fuzz", validate::parse_npy(input, "fuzz.npy")}}); }

void fuzz_npy_table(Bytes input) {
  const validate::NpyTable table = validate::parse_npy_table(input, "fuzz.npy");
  for (const validate::NpyTable::Column& column : table.columns)
    table.numbers(column.name, "fuzz.npy");
}

void fuzz_npz(Bytes input) { read_arrays(validate::parse_npz(input, "fuzz.npz")); }

/// Parts of the input as the arrays of an archive.
void fuzz_npz_arrays(Bytes input) {
  std::vector<core::NpzArray> arrays;
  for (const Part& part : parts_of(input))
    if (is_plain_name(part.name) && arrays.size() < 16)
      arrays.push_back({.name = std::string(part.name),
                        .npy = {part.bytes.begin(), part.bytes.end()},
                        .is_deflated = arrays.size() % 2 == 1});
  for (std::size_t i = 0; i < arrays.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (arrays[i].name == arrays[k].name) return;  // which no archive is made of
  if (arrays.empty()) return;
  read_arrays(validate::parse_npz(core::npz_bytes(arrays), "fuzz.npz"));
}

}  // namespace terracast::fuzz
