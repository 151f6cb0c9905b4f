#include "validate/readers/sqlite.h"

#include <sqlite3.h>

#include "core/error.h"

namespace terracast::validate {

namespace {

/// A view may be a query without end, and functions of a file's schema may do anything: neither is run.
/// returns   SQLite's status
int distrust(sqlite3* handle) {
  int status = sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  if (status == SQLITE_OK)
    status = sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  if (status == SQLITE_OK)
    status = sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  return status;
}

}  // namespace

std::int64_t SqliteRow::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}
double SqliteRow::number(int column) const { return sqlite3_column_double(statement_, column); }
bool SqliteRow::is_null(int column) const {
  return sqlite3_column_type(statement_, column) == SQLITE_NULL;
}
std::string SqliteRow::text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_, column);
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}
const void* SqliteRow::blob(int column) const { return sqlite3_column_blob(statement_, column); }
std::size_t SqliteRow::num_bytes(int column) const {
  return static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
}

void SqliteDatabase::Close::operator()(sqlite3* handle) const { sqlite3_close(handle); }

SqliteDatabase SqliteDatabase::of_bytes(std::vector<std::byte> bytes, const std::string& name) {
  SqliteDatabase database(name);
  database.bytes_ = std::move(bytes);
  sqlite3* handle = nullptr;
  const int status = sqlite3_open_v2(":memory:", &handle, SQLITE_OPEN_READWRITE, nullptr);
  database.handle_.reset(handle);
  database.check(status);
  database.check(distrust(handle));
  const auto size = static_cast<sqlite3_int64>(database.bytes_.size());
  database.check(sqlite3_deserialize(handle, "main",
                                     reinterpret_cast<unsigned char*>(database.bytes_.data()), size,
                                     size, SQLITE_DESERIALIZE_READONLY));
  return database;
}

SqliteDatabase SqliteDatabase::of_file(const std::filesystem::path& file, const std::string& name) {
  SqliteDatabase database(name);
  sqlite3* handle = nullptr;
  const int status = sqlite3_open_v2(file.c_str(), &handle, SQLITE_OPEN_READONLY, nullptr);
  database.handle_.reset(handle);
  database.check(status);
  database.check(distrust(handle));
  return database;
}

void SqliteDatabase::each_row(const std::string& sql,
                              const std::function<void(const SqliteRow&)>& visit) const {
  struct Finish {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  sqlite3_stmt* prepared = nullptr;
  check(sqlite3_prepare_v2(handle_.get(), sql.c_str(), -1, &prepared, nullptr));
  const std::unique_ptr<sqlite3_stmt, Finish> statement(prepared);
  // Pages that lead back to each other have no last row.
  constexpr std::int64_t kMostRows = std::int64_t{1} << 24;
  int status = SQLITE_ROW;
  for (std::int64_t num_rows = 1; (status = sqlite3_step(prepared)) == SQLITE_ROW; ++num_rows) {
    if (num_rows > kMostRows)
      core::fail(core::ErrorKind::Input, "{}: more than {} rows of \"{}\"", name_, kMostRows, sql);
    visit(SqliteRow(prepared));
  }
  check(status);
}

void SqliteDatabase::check(int status) const {
  if (status != SQLITE_OK && status != SQLITE_DONE)
    core::fail(core::ErrorKind::Input, "{}: {}", name_,
               handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(status));
}

}  // namespace terracast::validate
