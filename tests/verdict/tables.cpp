#include "tests/verdict/tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "core/atomic_file.h"
#include "validate/text.h"

namespace terracast::test {

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> files_that(const fs::path& dataset, bool (*fits)(const std::string& path)) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(dataset))
    if (entry.is_regular_file() &&
        fits("/" + entry.path().lexically_relative(dataset).generic_string()))
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

std::vector<std::string>& Table::draw_row(Draws& draws, std::size_t first) {
  return rows[(has_header ? 1 : 0) + first +
              static_cast<std::size_t>(draws.below(static_cast<int>(num_rows() - first)))];
}

void Table::write() const {
  std::string text;
  for (const std::vector<std::string>& row : rows)
    text += fmt::format("{}\n", fmt::join(row, std::string(1, separator)));
  core::write_file(file, text);
}

Table read_table(const fs::path& file, char separator, bool has_header) {
  Table table{file, separator, has_header, {}};
  const std::string text = core::read_text_file(file);
  for (const validate::TextLine& line : validate::split_lines(text)) {
    std::vector<std::string> row;
    for (const std::string_view word : validate::split_at(line.text, separator))
      row.emplace_back(word);
    table.rows.push_back(std::move(row));
  }
  return table;
}

double number_of(const std::string& text) { return std::stod(text); }

std::string text_of(double number) { return fmt::format("{:.17g}", number); }

std::vector<PoseTable> pose_tables_of(const fs::path& dataset) {
  std::vector<PoseTable> tables;
  for (const fs::path& file :
       files_that(dataset, [](const std::string& path) { return path.ends_with("/poses.csv"); }))
    tables.push_back({read_table(file, ',', true), {3, 4, 5}, {6, 7, 8, 9}, 0});
  // Of KITTI the first row is 1 in any dataset.
  for (const fs::path& file : files_that(dataset, [](const std::string& path) {
         return path.ends_with("/poses.txt") ||
                (path.ends_with(".txt") && path.find("/poses/") != std::string::npos);
       }))
    tables.push_back({read_table(file, ' ', false), {3, 7, 11}, {0, 1, 2, 4, 5, 6, 8, 9, 10}, 1});
  for (const fs::path& file : files_that(dataset, [](const std::string& path) {
         return path.ends_with(".txt") && path.find("/pose_") != std::string::npos;
       }))
    tables.push_back({read_table(file, ' ', false), {0, 1, 2}, {6, 3, 4, 5}, 0});
  std::erase_if(tables, [](const PoseTable& one) { return one.table.num_rows() <= one.first_row; });
  return tables;
}

std::vector<PoseTable> place_tables_of(const fs::path& dataset) {
  std::vector<PoseTable> tables;
  for (const fs::path& file : files_that(
           dataset, [](const std::string& path) { return path.ends_with("/georeference.csv"); }))
    tables.push_back({read_table(file, ',', true), {3, 4, 5}, {6, 7, 8, 9}, 0});
  std::erase_if(tables, [](const PoseTable& one) { return one.table.num_rows() == 0; });
  return tables;
}

void turn_row(std::vector<std::string>& row, const PoseTable& poses, const Eigen::Quaterniond& by) {
  const auto number = [&](std::size_t i) { return number_of(row[poses.attitude[i]]); };
  if (poses.attitude.size() == 4) {
    const Eigen::Quaterniond turned =
        Eigen::Quaterniond(number(0), number(1), number(2), number(3)) * by;
    const std::array<double, 4> values{turned.w(), turned.x(), turned.y(), turned.z()};
    for (std::size_t i = 0; i < 4; ++i) row[poses.attitude[i]] = text_of(values[i]);
    return;
  }
  Eigen::Matrix3d rotation;
  for (std::size_t i = 0; i < 9; ++i)
    rotation(static_cast<int>(i / 3), static_cast<int>(i % 3)) = number(i);
  rotation *= by.toRotationMatrix();
  for (std::size_t i = 0; i < 9; ++i)
    row[poses.attitude[i]] = text_of(rotation(static_cast<int>(i / 3), static_cast<int>(i % 3)));
}

}  // namespace terracast::test
