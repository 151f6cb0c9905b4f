#include "core/npy.h"

#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/npz.h"
#include "tests/support/npz_reader.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The bytes that numpy 1.24 writes for np.save(f, np.array([[1.5], [-2]], '<f4')).
TEST(Npy, IsWhatNumpyWrites) {
  const std::vector<float> values = {1.5F, -2.0F};
  std::string expected("\x93NUMPY\x01\x00\x76\x00", 10);
  expected += "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1), }";
  expected.append(127 - expected.size(), ' ');
  expected += '\n';
  expected += std::string("\x00\x00\xc0\x3f\x00\x00\x00\xc0", 8);
  EXPECT_EQ(text_of(core::npy_bytes(values, {2, 1})), expected);
}

TEST(Npy, ShapesOfAllRanksAreRead) {
  const std::vector<float> values = {1, 2, 3, 4, 5, 6};
  for (const std::vector<int>& shape : {std::vector<int>{6}, {2, 3}, {1, 2, 3}, {1, 1, 6, 1}}) {
    const test::Array array = test::parse_npy(text_of(core::npy_bytes(values, shape)));
    EXPECT_EQ(array.shape, shape);
    EXPECT_EQ(array.values, values);
  }
  ImageF image(3, 2);
  image(2, 1) = 7.0F;
  const test::Array array = test::parse_npy(text_of(core::npy_bytes(image)));
  EXPECT_EQ(array.shape, (std::vector<int>{2, 3}));  // rows first
  EXPECT_EQ(array.values[5], 7.0F);
}

TEST(Npy, NumbersOfAllTypesAreRead) {
  const std::vector<double> doubles = {1.0 / 3.0, -1e300};
  const test::Array of_doubles = test::parse_npy(text_of(npy_bytes(doubles, {2})));
  EXPECT_EQ(of_doubles.type, "<f8");
  EXPECT_EQ(of_doubles.numbers, doubles);
  const std::vector<std::int32_t> signed_values = {-1, 2147483647};
  const test::Array of_signed = test::parse_npy(text_of(npy_bytes(signed_values, {2, 1})));
  EXPECT_EQ(of_signed.type, "<i4");
  EXPECT_EQ(of_signed.numbers, (std::vector<double>{-1.0, 2147483647.0}));
  const std::vector<std::uint32_t> counts = {4294967295U};
  const test::Array of_counts = test::parse_npy(text_of(npy_bytes(counts, {1})));
  EXPECT_EQ(of_counts.type, "<u4");
  EXPECT_EQ(of_counts.numbers, (std::vector<double>{4294967295.0}));
  const test::Array empty = test::parse_npy(text_of(npy_bytes(std::vector<double>(), {0, 3})));
  EXPECT_EQ(empty.shape, (std::vector<int>{0, 3}));
}

TEST(Npz, ArraysComeBackStoredAndDeflated) {
  const test::ScratchFolder scratch;
  const std::vector<float> values(300, 0.25F);
  const std::vector<std::uint8_t> mask = {0, 1, 255, 0};
  const std::vector<NpzArray> arrays = {{"flow", core::npy_bytes(values, {3, 100}), false},
                                        {"mask", core::npy_bool_bytes(mask, {2, 2}), true}};
  const std::vector<std::byte> bytes = npz_bytes(arrays);
  write_file(scratch / "a.npz", bytes);
  const auto read = test::read_npz(scratch / "a.npz");
  EXPECT_EQ(read.at("flow").values, values);
  EXPECT_EQ(read.at("mask").type, "|b1");
  EXPECT_EQ(read.at("mask").values, (std::vector<float>{0, 1, 1, 0}));
  EXPECT_EQ(bytes, npz_bytes(arrays));
  // 1980-01-01 00:00 in the first local header: time 0, day 0x0021.
  EXPECT_EQ(text_of(bytes).substr(10, 4), std::string("\x00\x00\x21\x00", 4));
}

}  // namespace
}  // namespace terracast::core
