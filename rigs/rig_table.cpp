#include "rigs/rig_table.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/registry.h"
#include "core/schema_writer.h"
#include "geo/fixes/text.h"
#include "geo/frames.h"
#include "geo/units.h"
#include "rigs/rig_file.h"

namespace terracast::rigs {
namespace {

using core::Constraint;
using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostRows = 1000;

/// Headings of published tables for our own.
const std::map<std::string, std::string, std::less<>>& other_headings() {
  static const std::map<std::string, std::string, std::less<>> table{
      {"camera", "name"},
      {"resolution", "imageresolution"},
      {"pixelaspectratio", "pixelaspect"},
      {"orientationaxisangle", "axisanglerad"},
      {"axisangle", "axisanglerad"},
      {"positionoffsetmm", "offsetmm"},
      {"nx", "nxrad"},
      {"ny", "nyrad"},
      {"nz", "nzrad"},
      {"rollangledeg", "rollangle"},
      {"pitchangledeg", "pitchangle"},
  };
  return table;
}

/// Letters and digits alone, in lower case: "Focal Length\n(mm)" and focal_length_mm are one.
std::string plain(std::string_view heading) {
  std::string word;
  for (const char c : heading) {
    if (c >= 'A' && c <= 'Z') word += static_cast<char>(c - 'A' + 'a');
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) word += c;
  }
  const auto other = other_headings().find(word);
  return other == other_headings().end() ? word : other->second;
}

bool is_blank(const std::string& cell) { return geo::trimmed(cell).empty(); }

/// Looks cells up, by heading; knows which headings were asked for.
class SheetReader {
 public:
  explicit SheetReader(const Sheet& sheet) : sheet_(sheet) {
    for (std::size_t column = 0; column < sheet.headings.size(); ++column) {
      if (is_blank(sheet.headings[column])) continue;
      if (!columns_.emplace(plain(sheet.headings[column]), column).second)
        fail(ErrorKind::Input, "{}: a second column of this heading; leave one out",
             heading_place(column));
    }
  }

  std::optional<std::size_t> find(std::string_view heading) {
    if (std::find(known_.begin(), known_.end(), heading) == known_.end())
      known_.emplace_back(heading);
    const auto found = columns_.find(plain(heading));
    if (found == columns_.end()) return std::nullopt;
    used_.insert(found->second);
    names_.emplace(found->second, heading);
    return found->second;
  }

  /// The cell, or, where it is empty, the one above it that is not.
  const std::string& cell_or_above(std::size_t row, std::size_t column) const {
    for (std::size_t above = row; above > 0; --above)
      if (!is_blank(sheet_.rows[above][column])) return sheet_.rows[above][column];
    return sheet_.rows[0][column];
  }
  const std::string& cell(std::size_t row, std::size_t column) const {
    return sheet_.rows[row][column];
  }
  std::string where(std::size_t row, std::size_t column) const { return sheet_.where(row, column); }
  std::string row_place(std::size_t row) const {
    return fmt::format("{}: row {}", sheet_.file.string(), sheet_.row_numbers[row]);
  }

  double number(std::string_view text, std::size_t row, std::size_t column) const {
    if (const std::optional<double> value = geo::number_of(text)) return *value;
    fail(ErrorKind::Input, "{}: \"{}\" is no number; one such as 3.24 is wanted",
         where(row, column), text);
  }

  /// What became of each column.
  core::Ledger ledger() const {
    core::Ledger ledger;
    for (std::size_t column = 0; column < sheet_.headings.size(); ++column) {
      const std::string& heading = sheet_.headings[column];
      if (used_.contains(column))
        ledger.use(names_.at(column));
      else if (!is_blank(heading))
        ledger.miss(misspelled(column));
      else if (std::any_of(sheet_.rows.begin(), sheet_.rows.end(),
                           [&](const auto& row) { return !is_blank(row[column]); }))
        ledger.miss(fmt::format("column {} (no heading)", column_letters(column)));
    }
    return ledger;
  }

 private:
  std::string heading_place(std::size_t column) const {
    return fmt::format("{}: column {} ({})", sheet_.file.string(), column_letters(column),
                       sheet_.headings[column]);
  }

  /// The heading of a column that nobody asked for.
  /// throws   Input: it is nearly one that is known, so that what was meant would be lost
  std::string misspelled(std::size_t column) const {
    const std::string& heading = sheet_.headings[column];
    const std::string nearest = core::nearest_name(heading, known_);
    if (nearest.empty()) return heading;
    fail(ErrorKind::Input,
         "{}: an unknown heading (nearest: {}); known are {}. A column of something else is told "
         "and "
         "passed over under a heading that is like none of these",
         heading_place(column), nearest, fmt::join(known_, ", "));
  }

  const Sheet& sheet_;
  std::map<std::string, std::size_t> columns_;
  std::set<std::size_t> used_;
  std::map<std::size_t, std::string> names_;  ///< the headings' own, of columns that are used
  std::vector<std::string> known_;
};

/// The numbers in a cell, between blanks, commas or semicolons.
std::vector<std::string_view> parts_of(std::string_view cell) {
  std::vector<std::string_view> parts;
  constexpr std::string_view kBetween = " \t,;";
  for (std::size_t begin = cell.find_first_not_of(kBetween); begin != std::string_view::npos;) {
    const std::size_t end = std::min(cell.find_first_of(kBetween, begin), cell.size());
    parts.push_back(cell.substr(begin, end - begin));
    begin = cell.find_first_not_of(kBetween, end);
  }
  return parts;
}

/// Fills a described struct from a row.
class RowReader : public core::SchemaVisitor {
 public:
  RowReader(SheetReader& sheet, std::size_t row) : sheet_(sheet), row_(row) {}

 protected:
  void visit_value(std::string_view name, core::ValueRef value, std::string_view,
                   const Constraint& constraint) override {
    std::visit([&](auto* target) { read(heading_of(name), *target, constraint); }, value);
  }
  virtual std::string heading_of(std::string_view key) const { return std::string(key); }
  /// A cell of a key that takes several numbers: a camera's own, as poses are.
  virtual const std::string& vector_cell(std::size_t row, std::size_t column) const {
    return sheet_.cell(row, column);
  }
  bool begin_section(std::string_view, std::string_view) override { return true; }
  void end_section() override {}
  std::size_t begin_list(std::string_view, std::string_view, std::size_t) override { return 0; }
  void end_list() override {}
  void begin_item(std::size_t) override {}
  void end_item() override {}
  const SheetReader& sheet() const { return sheet_; }
  std::string place() const { return sheet_.row_place(row_); }

 private:
  /// A cell that holds one value; null where there is no column, or nothing in it.
  const std::string* find_cell(const std::string& heading, std::size_t& column) {
    const std::optional<std::size_t> found = sheet_.find(heading);
    if (!found) return nullptr;
    column = *found;
    // A name is a camera's own.
    const std::string& cell =
        heading == "name" ? sheet_.cell(row_, column) : sheet_.cell_or_above(row_, column);
    return is_blank(cell) ? nullptr : &cell;
  }

  void check_range(double value, std::size_t column, const Constraint& constraint) const {
    if (value >= constraint.lowest && value <= constraint.highest) return;
    fail(ErrorKind::Input, "{}: {} is outside {} to {}", sheet_.where(row_, column), value,
         constraint.lowest, constraint.highest);
  }

  void read(const std::string& heading, double& out, const Constraint& constraint) {
    std::size_t column = 0;
    const std::string* cell = find_cell(heading, column);
    if (cell == nullptr) return;
    out = sheet_.number(*cell, row_, column);
    check_range(out, column, constraint);
  }
  void read(const std::string& heading, std::int64_t& out, const Constraint& constraint) {
    std::size_t column = 0;
    const std::string* cell = find_cell(heading, column);
    if (cell == nullptr) return;
    const double value = sheet_.number(*cell, row_, column);
    if (value != std::floor(value) || std::abs(value) > 9e15)
      fail(ErrorKind::Input, "{}: {} is no whole number", sheet_.where(row_, column), value);
    check_range(value, column, constraint);
    out = static_cast<std::int64_t>(value);
  }
  void read(const std::string& heading, std::string& out, const Constraint& constraint) {
    std::size_t column = 0;
    const std::string* cell = find_cell(heading, column);
    if (cell == nullptr) return;
    out = std::string(geo::trimmed(*cell));
    const std::vector<std::string> choices = constraint.named_choices();
    if (!choices.empty() && std::find(choices.begin(), choices.end(), out) == choices.end())
      fail(ErrorKind::Input, "{}: \"{}\"; one of {} is wanted", sheet_.where(row_, column), out,
           fmt::join(choices, ", "));
  }
  void read(const std::string& heading, bool& out, const Constraint&) {
    std::string text = out ? "true" : "false";
    read(heading, text, core::one_of({"true", "false"}));
    out = text == "true";
  }
  void read(const std::string& heading, core::Path&, const Constraint&) {
    std::size_t column = 0;
    if (find_cell(heading, column) != nullptr)
      fail(ErrorKind::Input, "{}: a file; a table holds the optics themselves, a rig file takes it",
           sheet_.where(row_, column));
  }
  void read(const std::string& heading, std::vector<double>& out, const Constraint& constraint) {
    std::vector<double> values;
    const auto add = [&](std::string_view text, std::size_t column) {
      values.push_back(sheet_.number(text, row_, column));
      check_range(values.back(), column, constraint);
    };
    std::size_t last_column = 0;
    if (const auto column = sheet_.find(heading)) {
      last_column = *column;
      for (const std::string_view part : parts_of(vector_cell(row_, *column))) add(part, *column);
    }
    const auto parts = components_of_keys().find(heading);
    if (parts != components_of_keys().end()) {
      for (const std::string& part : parts->second) {
        const auto column = sheet_.find(part);
        if (!column || is_blank(vector_cell(row_, *column))) continue;
        last_column = *column;
        add(vector_cell(row_, *column), *column);
      }
    }
    if (values.empty()) return;
    if (values.size() < constraint.min_size || values.size() > constraint.max_size)
      fail(ErrorKind::Input, "{}: {} of {} values of {}; give all of them",
           sheet_.where(row_, last_column), values.size(), constraint.min_size, heading);
    out = std::move(values);
  }
  template <class Other>
  void read(const std::string&, Other&, const Constraint&) {}  // a camera has no such key

  SheetReader& sheet_;
  std::size_t row_;
};

/// Keys of the rig itself, with its errors and imaging: its name's heading is rig; tables hold no templates.
class RigRowReader final : public RowReader {
 public:
  using RowReader::RowReader;

 protected:
  void visit_value(std::string_view name, core::ValueRef value, std::string_view meaning,
                   const Constraint& constraint) override {
    if (name != "template") RowReader::visit_value(name, value, meaning, constraint);
  }
  std::string heading_of(std::string_view key) const override {
    return key == "name" ? "rig" : std::string(key);
  }
  const std::string& vector_cell(std::size_t row, std::size_t column) const override {
    return sheet().cell_or_above(row, column);
  }
  bool runs_validation() const override { return true; }
  void locate(core::Error& error) const override {
    error = core::Error(ErrorKind::Input, fmt::format("{}: {}", place(), error.message()));
  }
};

/// A camera's image size in one cell, "720 x 640".
void read_resolution(SheetReader& sheet, std::size_t row, rigs::CameraOptions& camera) {
  const std::optional<std::size_t> column = sheet.find("image_resolution");
  if (!column) return;
  std::string cell = sheet.cell_or_above(row, *column);
  for (const std::string& sign :
       {std::string("\xc3\x97"), std::string("x"), std::string("X"), std::string("*")})
    for (std::size_t at; (at = cell.find(sign)) != std::string::npos;)
      cell.replace(at, sign.size(), " ");
  const std::vector<std::string_view> parts = parts_of(cell);
  double sides[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < 2 && parts.size() == 2; ++i)
    sides[i] = geo::number_of(parts[i]).value_or(0.0);
  for (const double side : sides)
    if (!(side >= 1.0 && side <= 16384.0 && side == std::floor(side)))
      fail(ErrorKind::Input, "{}: \"{}\" is no size of an image; one such as 720 x 640 is wanted",
           sheet.where(row, *column), sheet.cell_or_above(row, *column));
  camera.width_px = static_cast<std::int64_t>(sides[0]);
  camera.height_px = static_cast<std::int64_t>(sides[1]);
}

/// Places on a compound eye; whether the sheet holds such.
bool read_eye_place(SheetReader& sheet, std::size_t row, rigs::CameraOptions& camera) {
  const auto roll = sheet.find("roll_angle"), pitch = sheet.find("pitch_angle"),
             radius = sheet.find("radius_mm");
  if (!roll && !pitch && !radius) return false;
  if (!roll || !pitch || !radius)
    fail(ErrorKind::Input,
         "{}: of roll angle, pitch angle and radius (mm) not all three are there; together they "
         "place "
         "cameras on a compound eye",
         sheet.row_place(row));
  const auto number = [&](std::size_t column) {
    return sheet.number(sheet.cell_or_above(row, column), row, column);
  };
  camera.set_pose(rigs::rig_from_eye_camera(number(*roll), number(*pitch), number(*radius)));
  return true;
}

void check_camera(const rigs::CameraOptions& camera, const std::string& place) {
  if (camera.name.empty()) fail(ErrorKind::Input, "{}: no name; give each camera its own", place);
  if (camera.width_px == 0 || camera.height_px == 0)
    fail(ErrorKind::Input, "{}: no size of the image; give width_px and height_px", place);
  try {
    camera.validate();
  } catch (const core::Error& error) {
    fail(ErrorKind::Input, "{}: {}", place, error.message());
  }
}

/// Offsets and rotations that depend on the rig's axes; yaw, pitch and roll do not.
bool needs_axes(const rigs::CameraOptions& camera) {
  return !camera.offset_mm.empty() || !camera.axis_angle_rad.empty() ||
         !camera.quaternion_wxyz.empty() || !camera.look_at_mm.empty();
}

/// Collects a described struct's values as cells.
class CellLister final : public core::SchemaVisitor {
 public:
  struct Cell {
    std::string heading;
    std::string text;
    bool is_required;
  };
  std::vector<Cell> cells;

 protected:
  void visit_value(std::string_view name, core::ValueRef value, std::string_view,
                   const Constraint& constraint) override {
    std::visit([&](const auto* source) { add(std::string(name), *source, constraint); }, value);
  }
  bool begin_section(std::string_view, std::string_view) override { return true; }
  void end_section() override {}
  std::size_t begin_list(std::string_view, std::string_view, std::size_t size) override {
    return size;
  }
  void end_list() override {}
  void begin_item(std::size_t) override { ++depth_; }
  void end_item() override { --depth_; }

 private:
  template <class Value>
  void add(const std::string& heading, const Value& value, const Constraint& constraint) {
    if (depth_ > 0) return;  // of an item of a list
    if constexpr (std::is_same_v<Value, std::vector<double>>) {
      const auto parts = components_of_keys().find(heading);
      if (parts == components_of_keys().end()) {
        cells.push_back({heading, fmt::format("{}", fmt::join(value, " ")), constraint.required});
        return;
      }
      for (std::size_t i = 0; i < parts->second.size(); ++i)
        cells.push_back({parts->second[i], i < value.size() ? fmt::format("{}", value[i]) : "",
                         constraint.required});
    } else if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, std::string>) {
      cells.push_back({heading, fmt::format("{}", value), constraint.required});
    }
  }

  int depth_ = 0;
};

template <class Struct>
std::vector<CellLister::Cell> cells_of(Struct value) {
  CellLister lister;
  value.describe(lister);
  return std::move(lister.cells);
}

/// throws Input: a row that says something else of the rig than the first one; says what
void check_same_rig(const rigs::RigOptions& first, const rigs::RigOptions& row,
                    const std::string& place) {
  const std::vector<CellLister::Cell> wanted = cells_of(first), found = cells_of(row);
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (found.at(i).text != wanted[i].text)
      fail(
          ErrorKind::Input,
          "{}: {} is \"{}\", and \"{}\" in the first row; it is the rig's, whose cameras share it: "
          "leave the cell empty, or write a table for each rig",
          place, wanted[i].heading == "name" ? "rig" : wanted[i].heading, found[i].text,
          wanted[i].text);
}

/// Keys of the rig that a table holds: all but its template, which placed its cameras.
bool is_of_table(const rigs::RigOptions& rig, const std::string& heading) {
  if (heading == "template") return false;
  if (!rig.arrangement.is_made()) return true;
  std::vector<core::KeyInfo> of_template;
  rig.arrangement->clone()->describe(*core::make_key_lister(of_template));
  return std::none_of(of_template.begin(), of_template.end(),
                      [&](const core::KeyInfo& key) { return key.name == heading; });
}

}  // namespace

const std::map<std::string, std::vector<std::string>, std::less<>>& components_of_keys() {
  static const std::map<std::string, std::vector<std::string>, std::less<>> table{
      {"principal_point_px", {"cx_px", "cy_px"}},
      {"offset_mm", {"x_mm", "y_mm", "z_mm"}},
      {"axis_angle_rad", {"nx_rad", "ny_rad", "nz_rad"}},
      {"euler_deg", {"yaw_deg", "pitch_deg", "roll_deg"}},
      {"quaternion_wxyz", {"qw", "qx", "qy", "qz"}},
      {"look_at_mm", {"look_at_x_mm", "look_at_y_mm", "look_at_z_mm"}},
      {"mount_offset_m", {"mount_x_m", "mount_y_m", "mount_z_m"}},
  };
  return table;
}

std::string column_letters(std::size_t column) {
  std::string letters;
  for (std::size_t rest = column + 1; rest > 0; rest = (rest - 1) / 26)
    letters.insert(letters.begin(), static_cast<char>('A' + (rest - 1) % 26));
  return letters;
}

std::string Sheet::where(std::size_t row, std::size_t column) const {
  return fmt::format("{}: row {}, column {} ({})", file.string(), row_numbers[row],
                     column_letters(column), headings[column]);
}

ImportedRig rig_of_sheet(const Sheet& sheet, const ReadOptions& options) {
  if (sheet.rows.empty())
    fail(ErrorKind::Input, "{}: no row below the headings; a camera takes one each",
         sheet.file.string());
  if (sheet.rows.size() > kMostRows)
    fail(ErrorKind::Input, "{}: {} rows; a rig has up to {}", sheet.file.string(),
         sheet.rows.size(), kMostRows);
  SheetReader reader(sheet);
  rigs::RigOptions rig;
  rig.axes.clear();
  RigRowReader rig_reader(reader, 0);
  rig.describe(rig_reader);
  const bool has_axes = !rig.axes.empty();
  if (!has_axes) rig.axes = "flu";
  const rigs::RigOptions of_first_row = rig;
  const std::string stated_axes = has_axes ? std::exchange(rig.axes, "flu") : "";

  bool needs = false;
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) {
    rigs::RigOptions of_row;
    RigRowReader rig_row_reader(reader, row);
    of_row.describe(rig_row_reader);
    check_same_rig(of_first_row, of_row, reader.row_place(row));
    rigs::CameraOptions& camera = rig.cameras.emplace_back();
    RowReader row_reader(reader, row);
    camera.describe(row_reader);
    read_resolution(reader, row, camera);
    const bool has_pose = needs_axes(camera) || !camera.euler_deg.empty();
    needs = needs || needs_axes(camera);
    if (read_eye_place(reader, row, camera) && has_pose)
      fail(ErrorKind::Input, "{}: both a place on a compound eye and another pose; state one",
           reader.row_place(row));
  }
  core::Ledger ledger = reader.ledger();
  for (std::size_t row = 0; row < sheet.rows.size(); ++row)
    check_camera(rig.cameras[row], reader.row_place(row));

  if (!options.name.empty()) rig.name = options.name;
  if (rig.name.empty()) rig.name = safe_name(sheet.file.stem().string());
  if (!stated_axes.empty() && !options.axes.empty() && stated_axes != options.axes)
    fail(ErrorKind::Input, "{}: its column axes says {}, the command {}; leave one out",
         sheet.file.string(), stated_axes, options.axes);
  const std::string axes = stated_axes.empty() ? options.axes : stated_axes;
  if (needs && axes.empty())
    fail(ErrorKind::Input,
         "{}: nothing says which axes its offsets and rotations are in; give --axes rdf (x right, "
         "y down, "
         "z forward) or --axes flu (x forward, y left, z up), or a column axes",
         sheet.file.string());
  if (needs) rig.axes = axes;
  rig.validate();
  return {std::move(rig), std::move(ledger)};
}

Sheet sheet_of_rig(const rigs::RigOptions& rig) {
  Sheet sheet;
  const std::vector<rigs::CameraOptions> cameras = rig.placed_cameras();
  sheet.rows.resize(cameras.size());
  for (std::size_t row = 0; row < cameras.size(); ++row) sheet.row_numbers.push_back(row + 2);
  const auto add_column = [&](const std::string& heading, const auto& text_of_row) {
    sheet.headings.push_back(heading);
    for (std::size_t row = 0; row < cameras.size(); ++row)
      sheet.rows[row].push_back(text_of_row(row));
  };
  // Cameras of different models have different keys.
  std::vector<std::string> headings;
  std::set<std::string> stated;
  std::vector<std::map<std::string, std::string>> lines;
  std::map<std::string, std::string> defaults;
  for (const CellLister::Cell& cell : cells_of(rigs::CameraOptions{}))
    defaults[cell.heading] = cell.text;
  for (const rigs::CameraOptions& camera : cameras) {
    if (camera.lens.model().read != nullptr)
      fail(ErrorKind::Config,
           "camera {}: its model {} comes from a file, which a table cannot hold", camera.name,
           camera.model);
    std::map<std::string, std::string>& line = lines.emplace_back();
    for (const CellLister::Cell& cell : cells_of(camera)) {
      if (std::find(headings.begin(), headings.end(), cell.heading) == headings.end())
        headings.push_back(cell.heading);
      const auto as_default = defaults.find(cell.heading);
      if (cell.is_required || as_default == defaults.end() || as_default->second != cell.text)
        stated.insert(cell.heading);
      line[cell.heading] = cell.text;
    }
  }
  for (const std::string& heading : headings)
    if (stated.contains(heading))
      add_column(heading, [&](std::size_t row) { return lines[row][heading]; });
  const std::vector<CellLister::Cell> own = cells_of(rig);
  const std::vector<CellLister::Cell> own_defaults = cells_of(rigs::RigOptions{});
  for (const CellLister::Cell& cell : own) {
    const auto as_default =
        std::find_if(own_defaults.begin(), own_defaults.end(), [&](const CellLister::Cell& other) {
          return other.heading == cell.heading && other.text == cell.text;
        });
    if (!is_of_table(rig, cell.heading) ||
        (as_default != own_defaults.end() && cell.heading != "axes"))
      continue;
    add_column(cell.heading == "name" ? "rig" : cell.heading,
               [&](std::size_t row) { return row == 0 ? cell.text : std::string(); });
  }
  return sheet;
}

}  // namespace terracast::rigs
