#include "validate/readers/colmap_database.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstring>
#include <fstream>
#include <memory>

#include "core/atomic_file.h"
#include "tests/support/test_data.h"

namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPage_bytes = 512;

void run(const fs::path& file, const std::string& sql) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &handle), SQLITE_OK);
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> close(handle, &sqlite3_close);
  ASSERT_EQ(sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(handle);
}

/// With all tables that are read, and pages to spare.
void make_database(const fs::path& file) {
  run(file,
      "PRAGMA page_size = 512;"
      "CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, model, width, "
      "height, params, prior_focal_length);"
      "CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name, camera_id, "
      "prior_qw, prior_qx, prior_qy, prior_qz, prior_tx, prior_ty, prior_tz);"
      "CREATE TABLE pose_priors (image_id INTEGER PRIMARY KEY, position, coordinate_system, "
      "position_covariance);"
      "CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, data);"
      "CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, data);"
      "CREATE TABLE matches (pair_id INTEGER PRIMARY KEY, data);"
      "CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY, data);"
      "CREATE TABLE spare (id INTEGER PRIMARY KEY, data);");
  for (int i = 1; i <= 12; ++i)
    run(file, "INSERT INTO spare VALUES (" + std::to_string(i) + ", zeroblob(400))");
}

/// The page of a table's root, by SQLite itself.
std::uint32_t root_page(const fs::path& file, const std::string& table) {
  sqlite3* handle = nullptr;
  EXPECT_EQ(sqlite3_open(file.c_str(), &handle), SQLITE_OK);
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> close(handle, &sqlite3_close);
  std::uint32_t page = 0;
  const auto take = [](void* into, int, char** values, char**) {
    *static_cast<std::uint32_t*>(into) = static_cast<std::uint32_t>(std::stoul(values[0]));
    return 0;
  };
  EXPECT_EQ(sqlite3_exec(
                handle, ("SELECT rootpage FROM sqlite_master WHERE name = '" + table + "'").c_str(),
                take, &page, nullptr),
            SQLITE_OK);
  return page;
}

/// An inner page of a table's tree (SQLite's file format, section 1.6), all of whose children are one page.
void write_inner_page(std::string& bytes, std::uint32_t page, std::uint32_t child) {
  constexpr std::size_t kHeader_bytes = 12, kCell_bytes = 5, kNumCells = 60;
  std::string content(kPage_bytes, '\0');
  const auto big_endian = [&](std::size_t at, std::uint64_t value, int num_bytes) {
    for (int i = 0; i < num_bytes; ++i)
      content[at + static_cast<std::size_t>(i)] =
          static_cast<char>(value >> (8 * (num_bytes - 1 - i)));
  };
  content[0] = 5;
  big_endian(3, kNumCells, 2);
  big_endian(5, kPage_bytes - kNumCells * kCell_bytes, 2);
  big_endian(8, child, 4);
  for (std::size_t i = 0; i < kNumCells; ++i) {
    const std::size_t cell = kPage_bytes - (i + 1) * kCell_bytes;
    big_endian(kHeader_bytes + 2 * i, cell, 2);
    big_endian(cell, child, 4);
    content[cell + 4] = static_cast<char>(i + 1);  // the key, of one byte
  }
  bytes.replace((page - 1) * kPage_bytes, kPage_bytes, content);
}

TEST(ColmapDatabases, TellWhichTablesHaveRows) {
  const test::ScratchFolder folder;
  const fs::path file = folder / "database.db";
  make_database(file);
  EXPECT_TRUE(read_colmap_database(file, "database.db").other_tables.empty());
  run(file, "INSERT INTO matches VALUES (7, NULL); INSERT INTO matches VALUES (8, NULL)");
  EXPECT_EQ(read_colmap_database(file, "database.db").other_tables,
            std::vector<std::string>{"matches"});
}

// 61 children to a page, and eight pages deep: 61^8 rows, which nobody lives to see counted.
TEST(ColmapDatabases, AreNotCounted) {
  const test::ScratchFolder folder;
  const fs::path file = folder / "database.db";
  make_database(file);
  run(file, "INSERT INTO keypoints VALUES (1, NULL)");
  std::string bytes = core::read_text_file(file);
  const std::uint32_t root = root_page(file, "keypoints");
  const auto num_pages = static_cast<std::uint32_t>(bytes.size() / kPage_bytes);
  constexpr std::uint32_t kDeep = 8;
  const std::uint32_t leaf = num_pages;
  bytes.replace((leaf - 1) * kPage_bytes, kPage_bytes,
                bytes.substr((root - 1) * kPage_bytes, kPage_bytes));
  for (std::uint32_t depth = 0; depth < kDeep; ++depth)
    write_inner_page(bytes, depth == 0 ? root : leaf - depth,
                     depth + 1 == kDeep ? leaf : leaf - depth - 1);
  core::write_file(file, std::string_view(bytes));
  EXPECT_EQ(read_colmap_database(file, "database.db").other_tables,
            std::vector<std::string>{"keypoints"});
}

}  // namespace
}  // namespace terracast::validate
