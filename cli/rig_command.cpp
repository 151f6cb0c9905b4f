#include "cli/rig_command.h"

#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/log.h"
#include "core/registry.h"
#include "rigs/picture/rig_picture.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/rig_view.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

struct Arguments {
  fs::path rig, file, output, onto;
  std::string format;
  rigs::ReadOptions read;
  bool shows_ledger = false;
};

std::vector<std::string> names_of_written_formats() {
  std::vector<std::string> names;
  for (const rigs::RigFormatInfo& format : rigs::rig_formats())
    if (format.write != nullptr) names.emplace_back(format.name);
  return names;
}

const rigs::RigFormatInfo& format_called(const std::string& name) {
  return core::find_registered(rigs::rig_formats(), "format of rigs", name);
}

int run_show(const Arguments& args) {
  const std::string extension = args.output.extension().string();
  if (!args.output.empty() && extension != ".svg" && extension != ".png")
    fail(ErrorKind::Usage,
         "--output {}: the picture is an SVG or PNG; give it a name that ends in .svg or .png",
         args.output.string());
  const rigs::RigView view(rigs::read_rig(args.rig));
  if (extension == ".svg") core::write_file(args.output, rigs::draw_rig(view).svg());
  if (extension == ".png")
    core::write_file(args.output, core::encode_png(rigs::draw_rig(view).raster(), 9));
  fmt::print("{}", rigs::rig_text(view));
  return 0;
}

int run_import(const Arguments& args) {
  const rigs::RigFormatInfo& format =
      args.format.empty() ? rigs::find_rig_format(args.file) : format_called(args.format);
  if (!args.read.axes.empty() && !format.is_table)
    fail(ErrorKind::Usage, "--axes is for tables; {} has axes of its own", format.name);
  const rigs::ImportedRig read =
      core::with_context([&] { return rigs::import_rig(format, args.file, args.read); },
                         fmt::format("importing a rig of format {}", format.name));
  rigs::RigOptions rig = read.rig;
  if (!args.onto.empty()) {
    rig = rigs::read_rig(args.onto);
    rigs::add_sensors(read.rig, rig);
  }
  const std::string text = rigs::rig_toml(rig);
  if (!args.output.empty()) core::write_file(args.output, text);
  if (args.shows_ledger)
    fmt::print("{}", read.ledger.table());
  else if (args.output.empty())
    fmt::print("{}", text);
  if (args.onto.empty() && format.is_of_sensors)
    core::Log("rig").warn(
        "{}: its sensors are no rig without a camera; --onto RIG adds them to one",
        args.file.string());
  for (const std::string& line : rigs::lines_not_used(read.ledger))
    core::Log("rig").warn("{}: {}", args.file.string(), line);
  return 0;
}

int run_export(const Arguments& args) {
  const rigs::RigOptions rig = rigs::read_rig(args.rig);
  const rigs::RigFormatInfo& format = format_called(args.format);
  if (format.write == nullptr)
    fail(ErrorKind::Usage, "--format {}: it is only read; a rig is written as one of {}",
         format.name, fmt::join(names_of_written_formats(), ", "));
  format.write(rig, args.output);
  const std::vector<std::string> left_out = rigs::keys_left_out(format, rig);
  if (!left_out.empty())
    core::Log("rig").warn("{}: the format {} does not hold, and the file leaves out: {}",
                          args.output.string(), format.name, fmt::join(left_out, ", "));
  return 0;
}

}  // namespace

void add_rig_command(CLI::App& app, int& status) {
  auto args = std::make_shared<Arguments>();
  auto* command =
      app.add_subcommand("rig", "Look at rigs of cameras, and exchange them with other programs.");
  command->require_subcommand(1);
  const std::string formats =
      fmt::format("One of {}", fmt::join(core::registry_names(rigs::rig_formats()), ", "));
  constexpr const char* kRig = "A rig file, TOML, such as configs/rigs/mcs4.toml.";

  auto* show = command->add_subcommand(
      "show", "Print each camera's K, T and field of view; draw frusta, coverage and overlaps.");
  show->add_option("RIG", args->rig, kRig)->required();
  show->add_option("-o,--output", args->output, "The picture to write, SVG or PNG.");
  show->callback([args, &status] { status = run_show(*args); });

  auto* in = command->add_subcommand("import", "Read another program's rig into a rig file.");
  in->add_option("FILE", args->file,
                 "The file; of COLMAP, and of a stereo pair of ROS, the folder.")
      ->required();
  in->add_option("-o,--output", args->output, "The rig file to write; printed when left out.");
  in->add_option("--format", args->format, formats + "; found out from the file when left out.");
  in->add_flag("--ledger", args->shows_ledger,
               "Print instead of the rig file each key, member or column of the file, and what "
               "became of it.");
  in->add_option("--name", args->read.name,
                 "Name of the rig; left out: the file's own, or of the file.");
  in->add_option("--axes", args->read.axes,
                 "Of a table that does not say: rdf (x right, y down, z forward) or flu (x "
                 "forward, y left, z up).")
      ->check(CLI::IsMember({"flu", "rdf"}));
  in->add_option(
      "--onto", args->onto,
      "A rig file; the rig that is written is that one with the file's sensors added, and "
      "nothing of the file's cameras.");
  in->add_option("--imu-rate-hz", args->read.imu_rate_hz,
                 "Samples a second of an IMU whose noise the file states by its samples (VINS).")
      ->check(CLI::Range(1e-3, 1e6));
  in->callback([args, &status] { status = run_import(*args); });

  auto* out = command->add_subcommand("export", "Write a rig for another program.");
  out->add_option("RIG", args->rig, kRig)->required();
  out->add_option("--format", args->format,
                  fmt::format("One of {}.", fmt::join(names_of_written_formats(), ", ")))
      ->required();
  out->add_option("-o,--output", args->output, "The file to write; of COLMAP a folder.")
      ->required();
  out->callback([args, &status] { status = run_export(*args); });
}

}  // namespace terracast::cli
