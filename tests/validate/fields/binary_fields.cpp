#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <variant>

#include "core/image_io.h"
#include "tests/validate/fields/fields.h"

namespace terracast::test {

namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

template <class Value>
Value value_at(const std::string& bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.data() + at, sizeof(Value));
  return value;
}

/// The value at a place changed.
template <class Value>
void change_value(std::string& bytes, std::size_t at, const Amount& amount) {
  const auto value = value_at<Value>(bytes, at);
  Value changed = value;
  if constexpr (std::is_floating_point_v<Value>)
    changed = std::isfinite(value) ? static_cast<Value>(amount.changed(static_cast<double>(value)))
                                   : value;
  else
    changed = static_cast<Value>(amount.changed(static_cast<std::int64_t>(value)));
  std::memcpy(bytes.data() + at, &changed, sizeof(Value));
}

template <class Value>
NamedChange value_change(std::string name, std::size_t at) {
  return {std::move(name), [at](std::string bytes, const Amount& amount) {
            change_value<Value>(bytes, at, amount);
            return bytes;
          }};
}

/// An array in the bytes of an npy.
struct NpyLayout {
  std::string type;  ///< "<f4"
  std::size_t begin = 0, num_values = 1, num_channels = 1;
};

NpyLayout layout_of(const std::string& bytes) {
  NpyLayout layout;
  layout.begin = 10U + value_at<std::uint16_t>(bytes, 8);
  const std::string head = bytes.substr(10, layout.begin - 10);
  const std::size_t type = head.find("'descr': '") + 10;
  layout.type = head.substr(type, head.find('\'', type) - type);
  const std::size_t shape = head.find('(');
  std::vector<std::size_t> sizes;
  for (std::size_t at = shape + 1; head.at(at) != ')';) {
    std::size_t length = 0;
    sizes.push_back(std::stoull(head.substr(at), &length));
    at += length;
    at = std::min(head.find_first_of("0123456789", at), head.find(')', at));
  }
  for (const std::size_t size : sizes) layout.num_values *= size;
  constexpr std::size_t kMostChannels = 4;
  if (sizes.size() == 3 && sizes[2] <= kMostChannels) layout.num_channels = sizes[2];
  return layout;
}

void change_npy_value(std::string& bytes, const std::string& type, std::size_t at,
                      const Amount& amount) {
  if (type == "<f4")
    change_value<float>(bytes, at, amount);
  else if (type == "<f8")
    change_value<double>(bytes, at, amount);
  else if (type == "|b1")
    bytes[at] = bytes[at] == 0 ? 1 : 0;
  else if (type == "|u1")
    change_value<std::uint8_t>(bytes, at, amount);
  else if (type == "<u4")
    change_value<std::uint32_t>(bytes, at, amount);
  else
    throw std::runtime_error("an npy of the type " + type);
}

std::size_t item_size(const std::string& type) {
  return static_cast<std::size_t>(type.back() - '0');
}

/// All values of a channel.
std::string changed_channel(std::string bytes, std::size_t channel, const Amount& amount) {
  const NpyLayout layout = layout_of(bytes);
  for (std::size_t i = channel; i < layout.num_values; i += layout.num_channels)
    change_npy_value(bytes, layout.type, layout.begin + i * item_size(layout.type), amount);
  return bytes;
}

template <class Image>
std::string png_of(const Image& image) {
  const std::vector<std::byte> bytes = core::encode_png(image);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A relative change takes each value from the pixel 1 to 3 px beside, an absolute one adds that many levels.
template <class Image>
std::string changed_levels(const Image& image, int channel, const Amount& amount) {
  Image changed = image;
  const auto step = static_cast<int>(amount.signed_size());
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const int beside = std::clamp(x + step, 0, image.width() - 1);
      auto& value = changed(x, y, channel);
      using Level = std::remove_reference_t<decltype(value)>;
      value = amount.is_relative ? image(beside, y, channel)
                                 : static_cast<Level>(image(x, y, channel) + step);
    }
  return png_of(changed);
}

/// TartanAir's floats in four channels: blue, green, red, alpha are their bytes from the least on.
std::string changed_float_png(const core::Image8& image, const Amount& amount) {
  core::Image8 changed = image;
  constexpr std::array<std::size_t, 4> kChannelOfByte = {2, 1, 0, 3};
  for (std::size_t i = 0; i < image.data().size(); i += 4) {
    std::string bytes(4, '\0');
    for (std::size_t k = 0; k < 4; ++k)
      bytes[k] = static_cast<char>(image.data()[i + kChannelOfByte[k]]);
    change_value<float>(bytes, 0, amount);
    for (std::size_t k = 0; k < 4; ++k)
      changed.data()[i + kChannelOfByte[k]] = static_cast<std::uint8_t>(bytes[k]);
  }
  return png_of(changed);
}

/// COLMAP's records, read one after the other.
class Records {
 public:
  Records(const std::string& bytes, std::vector<NamedChange>& fields)
      : bytes_(bytes), fields_(fields) {}

  template <class Value>
  Value take(const std::string& name) {
    fields_.push_back(value_change<Value>(name, at_));
    const auto value = value_at<Value>(bytes_, at_);
    at_ += sizeof(Value);
    return value;
  }
  void numbers(const char* name, int count) {
    for (int k = 0; k < count; ++k) take<double>(fmt::format("{}[{}]", name, k));
  }
  void text(const std::string& name) {
    const std::size_t begin = at_;
    at_ = bytes_.find('\0', at_) + 1;
    fields_.emplace_back(name, [begin](std::string bytes, const Amount&) {
      bytes[begin] = bytes[begin] == 'q' ? 'k' : 'q';
      return bytes;
    });
  }
  void pose() {
    numbers("rotation_wxyz", 4);
    numbers("translation", 3);
  }

 private:
  const std::string& bytes_;
  std::vector<NamedChange>& fields_;
  std::size_t at_ = 0;
};

void take_cameras(Records& records) {
  const std::map<std::int32_t, int> num_parameters = {{0, 3}, {1, 4},  {2, 4}, {3, 5},  {4, 8},
                                                      {5, 8}, {6, 12}, {7, 5}, {10, 12}};
  const auto count = records.take<std::uint64_t>("count");
  for (std::uint64_t i = 0; i < count; ++i) {
    records.take<std::uint32_t>("id");
    const auto model = records.take<std::int32_t>("model");
    records.take<std::uint64_t>("width");
    records.take<std::uint64_t>("height");
    records.numbers("parameter", num_parameters.at(model));
  }
}

void take_images(Records& records) {
  const auto count = records.take<std::uint64_t>("count");
  for (std::uint64_t i = 0; i < count; ++i) {
    records.take<std::uint32_t>("id");
    records.pose();
    records.take<std::uint32_t>("camera_id");
    records.text("name");
    const auto num_points = records.take<std::uint64_t>("num_points2d");
    for (std::uint64_t k = 0; k < num_points; ++k) {
      records.numbers("xy", 2);
      records.take<std::uint64_t>("point3d_id");
    }
  }
}

void take_points(Records& records) {
  const auto count = records.take<std::uint64_t>("count");
  for (std::uint64_t i = 0; i < count; ++i) {
    records.take<std::uint64_t>("id");
    records.numbers("position", 3);
    for (const char* name : {"red", "green", "blue"}) records.take<std::uint8_t>(name);
    records.take<double>("error");
    const auto length = records.take<std::uint64_t>("track_length");
    for (std::uint64_t k = 0; k < length; ++k) {
      records.take<std::uint32_t>("track_image_id");
      records.take<std::uint32_t>("track_index");
    }
  }
}

void take_rigs(Records& records) {
  const auto count = records.take<std::uint64_t>("count");
  for (std::uint64_t i = 0; i < count; ++i) {
    records.take<std::uint32_t>("id");
    const auto num_sensors = records.take<std::uint32_t>("num_sensors");
    for (std::uint32_t k = 0; k < num_sensors; ++k) {
      records.take<std::int32_t>("sensor_type");
      records.take<std::uint32_t>("sensor_id");
      if (k > 0 && records.take<std::uint8_t>("has_pose") != 0) records.pose();
    }
  }
}

void take_frames(Records& records) {
  const auto count = records.take<std::uint64_t>("count");
  for (std::uint64_t i = 0; i < count; ++i) {
    records.take<std::uint32_t>("id");
    records.take<std::uint32_t>("rig_id");
    records.pose();
    const auto num_data = records.take<std::uint32_t>("num_data");
    for (std::uint32_t k = 0; k < num_data; ++k) {
      records.take<std::int32_t>("sensor_type");
      records.take<std::uint32_t>("sensor_id");
      records.take<std::uint64_t>("data_id");
    }
  }
}

/// A database in memory, as the bytes of its file.
class MemoryDatabase {
 public:
  explicit MemoryDatabase(const std::string& bytes) {
    sqlite3* handle = nullptr;
    check(sqlite3_open(":memory:", &handle));
    handle_.reset(handle);
    auto* copy = static_cast<unsigned char*>(sqlite3_malloc64(bytes.size()));
    std::memcpy(copy, bytes.data(), bytes.size());
    const auto size = static_cast<sqlite3_int64>(bytes.size());
    check(sqlite3_deserialize(handle, "main", copy, size, size,
                              SQLITE_DESERIALIZE_FREEONCLOSE | SQLITE_DESERIALIZE_RESIZEABLE));
  }
  /// Rows of a query, as text; of blobs their bytes.
  std::vector<std::vector<std::string>> rows(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    check(sqlite3_prepare_v2(handle_.get(), sql.c_str(), -1, &statement, nullptr));
    std::vector<std::vector<std::string>> all;
    int status = 0;
    while ((status = sqlite3_step(statement)) == SQLITE_ROW) {
      all.emplace_back();
      for (int k = 0; k < sqlite3_column_count(statement); ++k) {
        const auto* data = static_cast<const char*>(sqlite3_column_blob(statement, k));
        const int size = sqlite3_column_bytes(statement, k);
        all.back().emplace_back(data == nullptr ? "" : data, static_cast<std::size_t>(size));
      }
    }
    sqlite3_finalize(statement);
    check(status == SQLITE_DONE ? SQLITE_OK : status);
    return all;
  }
  void set(const std::string& table, const std::string& row, const std::string& column,
           const std::string& sql_value) {
    check(sqlite3_exec(handle_.get(), "PRAGMA foreign_keys = OFF", nullptr, nullptr, nullptr));
    check(sqlite3_exec(
        handle_.get(),
        fmt::format("UPDATE {} SET {} = {} WHERE rowid = {}", table, column, sql_value, row)
            .c_str(),
        nullptr, nullptr, nullptr));
  }
  std::string bytes() {
    sqlite3_int64 size = 0;
    unsigned char* data = sqlite3_serialize(handle_.get(), "main", &size, 0);
    std::string copy(reinterpret_cast<char*>(data), static_cast<std::size_t>(size));
    sqlite3_free(data);
    return copy;
  }

 private:
  struct Close {
    void operator()(sqlite3* handle) const { sqlite3_close(handle); }
  };
  void check(int status) const {
    if (status != SQLITE_OK)
      throw std::runtime_error(handle_ ? sqlite3_errmsg(handle_.get()) : "SQLite does not open");
  }
  std::unique_ptr<sqlite3, Close> handle_;
};

std::string hexadecimal(const std::string& bytes) {
  std::string text = "x'";
  for (const char c : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return text + "'";
}

/// A cell changed: of a blob one of its doubles.
std::string changed_cell(const std::string& bytes, const std::string& table, const std::string& row,
                         const std::string& column, std::size_t part, const Amount& amount) {
  MemoryDatabase database(bytes);
  const auto cell = database
                        .rows(fmt::format("SELECT typeof({0}), {0} FROM {1} WHERE rowid = {2}",
                                          column, table, row))
                        .at(0);
  std::string value = cell[1];
  if (cell[0] == "blob") {
    change_value<double>(value, 8 * part, amount);
    if (value == cell[1]) return bytes;
    value = hexadecimal(value);
  } else if (cell[0] == "text") {
    value[0] = value[0] == 'q' ? 'k' : 'q';
    value = "'" + value + "'";
  } else if (cell[0] == "integer") {
    // So large that no other row has that key.
    constexpr std::int64_t kBeyondKeys = 1000;
    const bool is_key = column.ends_with("_id") && column != "camera_id";
    value = fmt::format("{}", amount.changed(static_cast<std::int64_t>(std::stoll(value))) +
                                  (is_key ? kBeyondKeys : 0));
  } else {
    value = fmt::format("{:.17g}", cell[0] == "null" ? 0.5 : amount.changed(std::stod(value)));
  }
  database.set(table, row, column, value);
  return database.bytes();
}

}  // namespace

std::vector<NamedChange> npy_fields(const std::string& bytes) {
  std::vector<NamedChange> fields;
  for (std::size_t k = 0; k < layout_of(bytes).num_channels; ++k)
    fields.emplace_back(fmt::format("channel {}", k),
                        [k](const std::string& all, const Amount& amount) {
                          return changed_channel(all, k, amount);
                        });
  return fields;
}

std::vector<NamedChange> png_fields(const std::string& bytes) {
  const auto decoded = core::decode_png(bytes_of(bytes), "png");
  const int num_channels = std::visit([](const auto& image) { return image.channels(); }, decoded);
  std::vector<NamedChange> fields;
  if (num_channels == 4) {
    fields.emplace_back("float", [](const std::string& all, const Amount& amount) {
      return changed_float_png(std::get<core::Image8>(core::decode_png(bytes_of(all), "png")),
                               amount);
    });
    return fields;
  }
  for (int k = 0; k < num_channels; ++k)
    fields.emplace_back(
        fmt::format("channel {}", k), [k](const std::string& all, const Amount& amount) {
          return std::visit([&](const auto& image) { return changed_levels(image, k, amount); },
                            core::decode_png(bytes_of(all), "png"));
        });
  return fields;
}

std::vector<NamedChange> colmap_fields(const std::string& file, const std::string& bytes) {
  std::vector<NamedChange> fields;
  Records records(bytes, fields);
  if (file == "cameras.bin") take_cameras(records);
  if (file == "images.bin") take_images(records);
  if (file == "points3D.bin") take_points(records);
  if (file == "rigs.bin") take_rigs(records);
  if (file == "frames.bin") take_frames(records);
  if (fields.empty()) throw std::runtime_error("no file of COLMAP's: " + file);
  return fields;
}

std::vector<NamedChange> database_fields(const std::string& bytes) {
  MemoryDatabase database(bytes);
  std::vector<NamedChange> fields;
  for (const auto& table :
       database.rows("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name"))
    for (const auto& column :
         database.rows(fmt::format("SELECT name FROM pragma_table_info('{}')", table[0])))
      for (const auto& row : database.rows(
               fmt::format("SELECT CAST(rowid AS TEXT), typeof({0}), length({0}) FROM {1}",
                           column[0], table[0]))) {
        const std::size_t num_parts = row[1] == "blob" ? std::stoull(row[2]) / 8 : 1;
        for (std::size_t part = 0; part < num_parts; ++part)
          fields.emplace_back(fmt::format("{}.{}{}", table[0], column[0],
                                          num_parts > 1 ? fmt::format("[{}]", part) : ""),
                              [=](const std::string& all, const Amount& amount) {
                                return changed_cell(all, table[0], row[0], column[0], part, amount);
                              });
      }
  return fields;
}

}  // namespace terracast::test
