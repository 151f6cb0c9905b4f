#include "validate/readers/sqlite.h"

#include <sqlite3.h>

#include "core/error.h"

namespace terracast::validate {

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
  int status = SQLITE_ROW;
  while ((status = sqlite3_step(prepared)) == SQLITE_ROW) visit(SqliteRow(prepared));
  check(status);
}

void SqliteDatabase::check(int status) const {
  if (status != SQLITE_OK && status != SQLITE_DONE)
    core::fail(core::ErrorKind::Input, "{}: {}", name_,
               handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(status));
}

}  // namespace terracast::validate
