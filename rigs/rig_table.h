#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "rigs/rig_format.h"

namespace terracast::rigs {

/// A sheet of text: a row of headings, then a row a camera.
struct Sheet {
  std::filesystem::path file;
  std::vector<std::string> headings;
  std::vector<std::vector<std::string>> rows;  ///< each as wide as the headings
  std::vector<std::size_t> row_numbers;        ///< in the file, counted from 1

  /// "rig.csv: row 3, column E (pitch_deg)"
  std::string where(std::size_t row, std::size_t column) const;
};

/// A spreadsheet's name of a column, counted from 0: A to Z, AA, ….
std::string column_letters(std::size_t column);

/// A camera's keys, and columns of published tables, as headings: letter case, blanks and signs do not matter.
///
///     name or camera, model, width_px, height_px or image resolution (720 x 640), focal_length_mm, …
///     x_mm y_mm z_mm, or position offset (mm) with three numbers;  nx_rad ny_rad nz_rad, or orientation
///     (axis-angle);  yaw_deg pitch_deg roll_deg;  qw qx qy qz;
///     roll angle, pitch angle, radius (mm): a place on a compound eye, as its template has it
///     rig, axes, mount_…: the rig's own, in the first row
///
/// An empty cell repeats the one above it, but for names and poses. A column whose heading is like none that is
/// known, or that has cells and no heading, is told by the ledger.
/// throws   Input: a heading that is nearly a known one, which is named; a cell that is no number or out of range, no
///          row, rows without a size, a pose stated in part; each with file, row and column. Axes that are nowhere
///          stated and matter.
ImportedRig rig_of_sheet(const Sheet& sheet, const ReadOptions& options);

/// Keys of several numbers, and what each is called where it has a column of its own.
const std::map<std::string, std::vector<std::string>, std::less<>>& components_of_keys();

/// The headings that rig_of_sheet knows, of all models.
std::span<const core::KnownName> known_headings();

/// The rig's cameras with all keys that one of them states.
Sheet sheet_of_rig(const rigs::RigOptions& rig);

}  // namespace terracast::rigs
