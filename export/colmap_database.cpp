#include <fmt/format.h>
#include <sqlite3.h>

#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "core/error.h"
#include "export/colmap_model.h"

namespace terracast::exporters {
namespace {

constexpr int kWgs84 = 0;  // COLMAP's number of latitude, longitude, height

// Tables and columns in COLMAP 3.8's own order, so that `SELECT *` finds what it expects; then the
// table that 3.10 added.
constexpr const char* kSchema = R"(
PRAGMA user_version = 3800;
CREATE TABLE cameras (
  camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  model INTEGER NOT NULL,
  width INTEGER NOT NULL,
  height INTEGER NOT NULL,
  params BLOB,
  prior_focal_length INTEGER NOT NULL);
CREATE TABLE images (
  image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  name TEXT NOT NULL UNIQUE,
  camera_id INTEGER NOT NULL,
  prior_qw REAL, prior_qx REAL, prior_qy REAL, prior_qz REAL,
  prior_tx REAL, prior_ty REAL, prior_tz REAL,
  CONSTRAINT image_id_check CHECK (image_id >= 0 AND image_id < 2147483647),
  FOREIGN KEY (camera_id) REFERENCES cameras (camera_id));
CREATE UNIQUE INDEX index_name ON images (name);
CREATE TABLE keypoints (
  image_id INTEGER PRIMARY KEY NOT NULL,
  rows INTEGER NOT NULL, cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY (image_id) REFERENCES images (image_id) ON DELETE CASCADE);
CREATE TABLE descriptors (
  image_id INTEGER PRIMARY KEY NOT NULL,
  rows INTEGER NOT NULL, cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY (image_id) REFERENCES images (image_id) ON DELETE CASCADE);
CREATE TABLE matches (
  pair_id INTEGER PRIMARY KEY NOT NULL,
  rows INTEGER NOT NULL, cols INTEGER NOT NULL, data BLOB);
CREATE TABLE two_view_geometries (
  pair_id INTEGER PRIMARY KEY NOT NULL,
  rows INTEGER NOT NULL, cols INTEGER NOT NULL, data BLOB,
  config INTEGER NOT NULL,
  F BLOB, E BLOB, H BLOB, qvec BLOB, tvec BLOB);
CREATE TABLE pose_priors (
  image_id INTEGER PRIMARY KEY NOT NULL,
  position BLOB,
  coordinate_system INTEGER NOT NULL,
  position_covariance BLOB,
  FOREIGN KEY (image_id) REFERENCES images (image_id) ON DELETE CASCADE);
)";

/// A database in memory; what SQLite refuses is a mistake of ours.
class Database {
 public:
  Database() {
    check(
        sqlite3_open_v2(":memory:", &handle_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr));
  }
  ~Database() { sqlite3_close(handle_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  sqlite3* handle() const { return handle_; }
  void check(int status) const {
    TERRACAST_CHECK(status == SQLITE_OK || status == SQLITE_DONE, "SQLite: {}",
                    sqlite3_errmsg(handle_));
  }
  void execute(const char* sql) const {
    check(sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr));
  }
  std::vector<std::byte> bytes() const {
    sqlite3_int64 size = 0;
    unsigned char* const data = sqlite3_serialize(handle_, "main", &size, 0);
    TERRACAST_CHECK(data != nullptr, "SQLite: no memory for {} bytes", size);
    std::vector<std::byte> copy(static_cast<std::size_t>(size));
    std::memcpy(copy.data(), data, copy.size());
    sqlite3_free(data);
    return copy;
  }

 private:
  sqlite3* handle_ = nullptr;
};

/// An INSERT; add() takes the row's values in the order of its columns.
class Insert {
 public:
  Insert(const Database& database, const char* sql) : database_(database) {
    database_.check(sqlite3_prepare_v2(database_.handle(), sql, -1, &statement_, nullptr));
  }
  ~Insert() { sqlite3_finalize(statement_); }
  Insert(const Insert&) = delete;
  Insert& operator=(const Insert&) = delete;

  template <class... Values>
  void add(const Values&... values) {
    int column = 0;
    (bind(++column, values), ...);
    database_.check(sqlite3_step(statement_));
    database_.check(sqlite3_reset(statement_));
  }

 private:
  void bind(int column, std::int64_t value) {
    database_.check(sqlite3_bind_int64(statement_, column, value));
  }
  void bind(int column, double value) {
    database_.check(sqlite3_bind_double(statement_, column, value));
  }
  void bind(int column, const std::string& text) {
    database_.check(sqlite3_bind_text(statement_, column, text.data(),
                                      static_cast<int>(text.size()), SQLITE_TRANSIENT));
  }
  void bind(int column, std::span<const double> values) {
    database_.check(sqlite3_bind_blob(statement_, column, values.data(),
                                      static_cast<int>(values.size_bytes()), SQLITE_TRANSIENT));
  }

  const Database& database_;
  sqlite3_stmt* statement_ = nullptr;
};

}  // namespace

std::vector<std::byte> colmap_database(const ColmapModel& model) {
  const Database database;
  database.execute("BEGIN");
  database.execute(kSchema);
  {
    Insert cameras(database, "INSERT INTO cameras VALUES (?, ?, ?, ?, ?, 1)");
    for (const ColmapCamera& camera : model.cameras)
      cameras.add(std::int64_t{camera.id}, std::int64_t{camera.lens.number},
                  std::int64_t{camera.width_px}, std::int64_t{camera.height_px},
                  std::span<const double>(camera.lens.parameters));
    Insert images(database,
                  "INSERT INTO images (image_id, name, camera_id, prior_tx, prior_ty, prior_tz) "
                  "VALUES (?, ?, ?, ?, ?, ?)");
    Insert priors(database, "INSERT INTO pose_priors VALUES (?, ?, ?, ?)");
    // Not a number, COLMAP's word for a covariance that nobody states.
    std::array<double, 9> unstated{};
    unstated.fill(std::numeric_limits<double>::quiet_NaN());
    for (const ColmapImage& image : model.images) {
      const std::array<double, 3> place{image.place.lat_deg, image.place.lon_deg,
                                        image.place.height_m};
      images.add(std::int64_t{image.id}, image.name, std::int64_t{image.camera_id}, place[0],
                 place[1], place[2]);
      priors.add(std::int64_t{image.id}, std::span<const double>(place), std::int64_t{kWgs84},
                 std::span<const double>(unstated));
    }
  }
  database.execute("COMMIT");
  return database.bytes();
}

}  // namespace terracast::exporters
