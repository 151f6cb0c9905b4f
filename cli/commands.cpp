#include "cli/commands.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "cli/batch_command.h"
#include "cli/evaluate_command.h"
#include "cli/plugin_command.h"
#include "cli/reference.h"
#include "cli/rig_command.h"
#include "cli/sources_page.h"
#include "cli/threads_option.h"
#include "cli/world_check_command.h"
#include "cli/world_export_command.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/parallel.h"
#include "core/plugin_rows.h"
#include "core/printable.h"
#include "core/registry.h"
#include "core/schema_writer.h"
#include "geo/geoid.h"
#include "job/stages.h"
#include "job/trace.h"
#include "plugins/blame.h"
#include "tiler/preview.h"
#include "validate/check.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using job::Job;
using job::OutputFolders;
using job::RunConfig;

/// What the options of all commands are parsed into.
struct Arguments {
  fs::path config, out, store, dataset, report, file;
  std::vector<std::string> sets, colmap, kinds;
  std::string shard = "0/1", format, name;
  int num_threads = 0;
  int size_px = 1024;
  int colmap_seeds = 3;
  int oracle_samples = 200;
  bool verbose = false, quiet = false, shows_ledger = false;
};

core::LogLevel log_level(const Arguments& args) {
  if (args.quiet) return core::LogLevel::Warn;
  return args.verbose ? core::LogLevel::Debug : core::LogLevel::Info;
}

/// The frames of a shard INDEX/COUNT.
capture::FrameSelection shard_from_text(const std::string& text) {
  const auto refuse = [&] {
    fail(ErrorKind::Usage,
         "--shard {}: shards are written INDEX/COUNT and counted from 0, as 0/4 to 3/4", text);
  };
  const auto slash = text.find('/');
  if (slash == std::string::npos) refuse();
  const auto number = [&](const std::string& digits) {
    if (digits.empty() || digits.size() > 6 ||
        digits.find_first_not_of("0123456789") != std::string::npos)
      refuse();
    return std::stoi(digits);
  };
  const int index = number(text.substr(0, slash));
  const int count = number(text.substr(slash + 1));
  if (index >= count) refuse();
  return {.first = index, .step = count};
}

/// Runs a command on a config with its log, events file and thread limit.
int with_config(const Arguments& args,
                const std::function<int(const RunConfig&, const core::Context&)>& work) {
  if (args.out.empty()) fail(ErrorKind::Usage, "--out is empty; name the folder of the results");
  const core::Log log("terracast", log_level(args));
  const core::ThreadLimit limit(args.num_threads);
  RunConfig config = job::load_run_config(args.config, args.sets);
  job::keep_captured_flags(config, OutputFolders(args.out).captures);
  core::make_folder(args.out);
  core::remove_temporaries(args.out);
  return work(
      config,
      {.log = log, .num_threads = args.num_threads, .events_file = args.out / "events.jsonl"});
}

fs::path store_folder(const Arguments& args) {
  return args.store.empty() ? OutputFolders(args.out).world : args.store;
}

/// The same for commands that need what the config names: its sources, cameras and motions.
int with_job(const Arguments& args,
             const std::function<int(const Job&, const core::Context&)>& work) {
  return with_config(args, [&](const RunConfig& config, const core::Context& context) {
    return work(job::prepare_job(config, context, store_folder(args)), context);
  });
}

world::TileStore open_store(const Arguments& args) {
  return world::TileStore::open(store_folder(args));
}

int run_all(const Arguments& args) {
  return with_job(args, [&](const Job& job, const core::Context& context) {
    const std::optional<bool> ok = run(job, args.out, context);
    const OutputFolders folders(args.out);
    if (!ok) {
      fmt::print("captured, not exported: {}\n", folders.captures.string());
    } else {
      for (const std::string& cause : validate::cause_lines(folders.reports))
        fmt::print("cause   {}\n", cause);
      fmt::print("{}: {}\n", validate::verdict_line(folders.reports),
                 (folders.reports / "index.html").string());
    }
    return ok.value_or(true) ? 0 : 1;
  });
}

int run_tile(const Arguments& args) {
  return with_job(args, [&](const Job& job, const core::Context& context) {
    const auto store = tile(job, store_folder(args), context);
    fmt::print("{}", tiler::describe_world(store));
    return 0;
  });
}

int run_render(const Arguments& args) {
  const capture::FrameSelection shard = shard_from_text(args.shard);
  return with_job(args, [&](const Job& job, const core::Context& context) {
    job::render(job, open_store(args), shard, OutputFolders(args.out).captures, context);
    return 0;
  });
}

int run_label(const Arguments& args) {
  return with_config(args, [&](const RunConfig& config, const core::Context& context) {
    RunConfig wanted = job::with_sequences(config, context, store_folder(args));
    for (const std::string& kind : args.kinds)
      if (std::none_of(wanted.labels.begin(), wanted.labels.end(),
                       [&](const labels::LabelOptions& one) { return one.kind == kind; }))
        wanted.labels.emplace_back(kind);
    if (job::wanted_labels(wanted).empty())
      fail(ErrorKind::Usage,
           "{} names no labels and no format that needs some; add a [[labels]], or say --what",
           args.config.string());
    job::label(wanted, open_store(args), OutputFolders(args.out).captures, context);
    return 0;
  });
}

int run_export(const Arguments& args) {
  return with_config(args, [&](const RunConfig& config, const core::Context& context) {
    export_formats(job::with_sequences(config, context, store_folder(args)),
                   OutputFolders(args.out), context);
    return 0;
  });
}

int run_validate(const Arguments& args) {
  const core::Log log("validate", log_level(args));
  const core::ThreadLimit limit(args.num_threads);
  const core::Context context{.log = log, .num_threads = args.num_threads, .events_file = {}};
  validate::ValidateOptions options{.format = args.format,
                                    .colmap = args.colmap,
                                    .colmap_seeds = args.colmap_seeds,
                                    .world = args.store,
                                    .oracle_samples = args.oracle_samples,
                                    .undulation_m = job::egm96_undulation_m};
  if (!args.store.empty())
    options.ground_map = job::ground_map_of(world::TileStore::open(args.store));
  const auto results = validate::run_validate_stage(args.dataset, options, args.report, context);
  bool all_ok = true;
  for (const auto& result : results) {
    fmt::print("{:7} {:32} {:>12.6g} {:8} bound {:<12.6g} {}\n",
               result.skipped ? "skipped"
               : result.ok    ? "ok"
                              : "FAILED",
               result.name, result.value, result.unit, result.bound,
               result.ok && !result.skipped ? "" : result.worst);
    all_ok = all_ok && (result.ok || result.skipped);
  }
  for (const std::string& cause : validate::cause_lines(args.report))
    fmt::print("cause   {}\n", cause);
  fmt::print("{}: {}\n", validate::verdict_line(args.report),
             (args.report / "index.html").string());
  return all_ok ? 0 : 1;
}

int run_evaluate(const Arguments& args, const EvaluateArguments& own, const CLI::App& command) {
  const core::Log log("evaluate", log_level(args));
  const core::Context context{.log = log, .num_threads = args.num_threads, .events_file = {}};
  const auto evaluation =
      validate::run_evaluate(checked_options(command, own), own.report, context);
  fmt::print("{}", validate::table_text(evaluation));
  if (!own.report.empty()) fmt::print("report: {}\n", (own.report / "index.html").string());
  return 0;
}

int run_world_info(const Arguments& args) {
  const auto store = world::TileStore::open(args.store);
  fmt::print("{}", args.shows_ledger ? tiler::ledger_text(store) : tiler::describe_world(store));
  return 0;
}

int run_world_preview(const Arguments& args) {
  if (args.file.extension() != ".png")
    fail(ErrorKind::Usage, "--output {}: the map is a PNG; give it a name that ends in .png",
         args.file.string());
  const auto store = world::TileStore::open(args.store);
  std::vector<tiler::PreviewPath> paths;
  if (!args.config.empty()) {
    const core::Log log("world", log_level(args));
    const core::Context context{.log = log, .num_threads = args.num_threads, .events_file = {}};
    const Job job =
        job::prepare_job(job::load_run_config(args.config, args.sets), context, args.store);
    if (job.ground->frame().origin() != store.manifest().origin)
      fail(ErrorKind::Config,
           "{}: its world starts at latitude {}, longitude {}, that of {} at {}, {}; give the job "
           "that the world was made for",
           args.config.string(), job.config.world.origin_lat_deg, job.config.world.origin_lon_deg,
           args.store.string(), store.manifest().origin.lat_deg, store.manifest().origin.lon_deg);
    paths = paths_of(job);
  }
  core::write_file(args.file,
                   core::encode_png(tiler::render_preview(store, paths, args.size_px), 6));
  fmt::print("{}\n", args.file.string());
  return 0;
}

/// What `world trace` is asked for: a place by latitude and longitude, by world x and y, or a pixel.
struct TraceArguments {
  double lat_deg = 0.0, lon_deg = 0.0, x = 0.0, y = 0.0;
  job::CapturedPixel pixel;
  std::vector<int> pixel_xy;
  bool as_json = false;
};

int run_world_trace(const Arguments& args, const TraceArguments& own, const CLI::App& command) {
  const auto is_given = [&](const char* option) { return command.count(option) > 0; };
  const int num_ways = is_given("--lat") + is_given("--x") + is_given("--capture");
  if (num_ways != 1)
    fail(ErrorKind::Usage,
         "world trace asks for one place: --lat and --lon, or --x and --y, or --capture with "
         "--frame "
         "and --pixel");
  const auto store = world::TileStore::open(args.store);
  core::Json trace;
  if (is_given("--lat")) {
    trace = job::trace_place(store, own.lat_deg, own.lon_deg);
  } else if (is_given("--x")) {
    trace = job::trace_world_place(store, {own.x, own.y});
  } else {
    job::CapturedPixel pixel = own.pixel;
    pixel.x = own.pixel_xy.at(0);
    pixel.y = own.pixel_xy.at(1);
    trace = job::trace_pixel(store, pixel);
  }
  fmt::print("{}", own.as_json ? trace.text() + "\n" : job::trace_text(trace));
  return 0;
}

CLI::App* add_trace_command(CLI::App& world_command, Arguments& args, TraceArguments& own) {
  CLI::App* trace = world_command.add_subcommand(
      "trace", "What stands at a place or in a pixel, and where that comes from.");
  trace->add_option("STORE", args.store, "Folder of the world.")->required();
  auto* lat = trace->add_option("--lat", own.lat_deg, "Latitude, WGS84, degrees.");
  auto* lon = trace->add_option("--lon", own.lon_deg, "Longitude, WGS84, degrees.");
  lat->needs(lon);
  lon->needs(lat);
  auto* x = trace->add_option("--x", own.x, "World x, m.");
  auto* y = trace->add_option("--y", own.y, "World y, m.");
  x->needs(y);
  y->needs(x);
  auto* capture = trace->add_option("--capture", own.pixel.capture, "Folder of the captures.");
  trace->add_option("--sequence", own.pixel.sequence, "Its sequence; left out: the only one.")
      ->needs(capture);
  trace->add_option("--camera", own.pixel.camera, "RIG/NAME; left out: the only one.")
      ->needs(capture);
  auto* frame = trace->add_option("--frame", own.pixel.frame, "Frame, counted from 0.");
  auto* pixel = trace->add_option("--pixel", own.pixel_xy, "Column and row, counted from 0.")
                    ->type_name("X,Y")
                    ->delimiter(',')
                    ->expected(2);
  frame->needs(capture);
  pixel->needs(capture);
  capture->needs(frame)->needs(pixel);
  trace->add_flag("--json", own.as_json, "Print JSON.");
  return trace;
}

int run_geoid_import(const Arguments& args) {
  const fs::path written =
      geo::import_egm2008(args.file, args.out.empty() ? geo::geoid_folder() : args.out);
  fmt::print("{}\n", written.string());
  return 0;
}

void add_common(CLI::App& command, Arguments& args) {
  add_threads_option(command, args.num_threads);
  command.add_flag("-v,--verbose", args.verbose, "Say what happens to each tile and frame.");
  command.add_flag("-q,--quiet", args.quiet, "Say only what changes the data or fails.");
}

void add_config(CLI::App& command, Arguments& args, bool is_required = true) {
  auto* option = command.add_option("CONFIG", args.config,
                                    "The job, TOML; `terracast config explain` lists its keys.");
  if (is_required) option->required();
  command
      .add_option("--set", args.sets,
                  "Set a key of the config, as --set world.seed=7; of an item of a list by its "
                  "number, as --set trajectories.0.num_frames=4 (repeatable).")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
}

CLI::App* add_job_command(CLI::App& app, const std::string& name, const std::string& summary,
                          Arguments& args) {
  CLI::App* command = app.add_subcommand(name, summary);
  add_config(*command, args);
  command
      ->add_option("--out", args.out,
                   "Folder of the job's results; a job that was cut off goes on there.")
      ->required();
  add_common(*command, args);
  return command;
}

int parse_and_run(int argc, const char* const* argv) {
  Arguments args;
  int status = 0;
  CLI::App app{"terracast: datasets for aerial and ground vision, with ground truth that is right.",
               "terracast"};
  app.require_subcommand(1);
  app.set_version_flag("--version", TERRACAST_VERSION);
  // Taken out of the command line before it comes here; described for --help.
  std::string plugin;
  app.add_option("--plugin", plugin,
                 "Load a plug-in first (repeatable, anywhere on the line); those in the folders of "
                 "TERRACAST_PLUGIN_PATH are loaded too.")
      ->type_name("FILE");
  app.footer(
      "Start with:\n  terracast run configs/demo.toml --out out/demo\n"
      "Each stage can be run alone (tile, render, label, export, validate), stopped and run "
      "again.");

  add_job_command(app, "run", "All stages: tile, render, label, export, validate.", args)
      ->callback([&] { status = run_all(args); });
  auto* tile_command = add_job_command(app, "tile", "Make the world's tiles.", args);
  tile_command->add_option("--world", args.store, "Folder of the world; OUT/world when left out.");
  tile_command->callback([&] { status = run_tile(args); });

  auto* render_command =
      add_job_command(app, "render", "Ray-cast the sequences into captures.", args);
  render_command->add_option("--world", args.store,
                             "Folder of the world; OUT/world when left out.");
  render_command
      ->add_option("--shard", args.shard,
                   "Render only frames INDEX, INDEX+COUNT, …; counted from 0.")
      ->type_name("INDEX/COUNT");
  render_command->callback([&] { status = run_render(args); });

  auto* label_command = add_job_command(
      app, "label", "Make the labels that the config, its formats or --what ask for.", args);
  label_command->add_option("--world", args.store, "Folder of the world; OUT/world when left out.");
  label_command
      ->add_option("--what", args.kinds,
                   "Kinds beside those of the config, which come too: " +
                       joined(core::registry_names(labels::labels())) + ", or several with commas.")
      ->type_name("KIND")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(core::registry_names(labels::labels())));
  label_command->callback([&] { status = run_label(args); });

  add_job_command(app, "export", "Write the captures in the formats of the config.", args)
      ->callback([&] { status = run_export(args); });

  auto* validate_command =
      app.add_subcommand("validate", "Check an exported dataset; exit status 1 when it is wrong.");
  validate_command->add_option("DATASET", args.dataset, "Folder of one exported dataset.")
      ->required();
  validate_command->add_option("--format", args.format,
                               "Its format; found out from the folder when left out.");
  validate_command->add_option("--report", args.report, "Folder for report.json and index.html.")
      ->required();
  validate_command
      ->add_option("--colmap", args.colmap,
                   "Ask the program COLMAP too: " + joined(validate::colmap_mode_names()) +
                       ", or several with commas.")
      ->type_name("MODE")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(validate::colmap_mode_names()));
  validate_command
      ->add_option("--colmap-seeds", args.colmap_seeds,
                   "Free reconstructions, of which the worst counts.")
      ->check(CLI::Range(1, 100));
  validate_command->add_option("--world", args.store,
                               "Folder of its world: the oracle holds pixels against exact rays.");
  validate_command
      ->add_option("--oracle-samples", args.oracle_samples,
                   "Pixels that the oracle draws at random from each image.")
      ->check(CLI::Range(1, 1000000));
  add_common(*validate_command, args);
  validate_command->callback([&] { status = run_validate(args); });

  EvaluateArguments evaluate;
  auto* evaluate_command = add_evaluate_command(app, evaluate);
  add_common(*evaluate_command, args);
  evaluate_command->callback([&] { status = run_evaluate(args, evaluate, *evaluate_command); });

  add_batch_command(app, status);
  add_rig_command(app, status);
  add_plugin_command(app, status);

  auto* world_command = app.add_subcommand("world", "Look into a world.");
  world_command->require_subcommand(1);
  auto* info =
      world_command->add_subcommand("info", "Extents, levels, tiles, sizes, datums, sources.");
  info->add_option("STORE", args.store, "Folder of the world.")->required();
  info->add_flag(
      "--ledger", args.shows_ledger,
      "What its sources' files say, by tag, key and attribute: used, ignored and why, unknown.");
  info->callback([&] { status = run_world_info(args); });
  auto* preview =
      world_command->add_subcommand("preview", "Draw a hillshaded map, with trajectories on it.");
  preview->add_option("STORE", args.store, "Folder of the world.")->required();
  preview->add_option("-o,--output", args.file, "The PNG to write.")->required();
  preview->add_option("--config", args.config, "A job whose trajectories are drawn.");
  preview->add_option("--set", args.sets, "Set a key of that job.")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  preview->add_option("--size", args.size_px, "Pixels of the longer side.")
      ->check(CLI::Range(64, 16384));
  preview->callback([&] { status = run_world_preview(args); });
  add_world_check_command(*world_command, status);
  add_world_export_command(*world_command, status);

  TraceArguments trace;
  auto* trace_command = add_trace_command(*world_command, args, trace);
  trace_command->callback([&] { status = run_world_trace(args, trace, *trace_command); });

  auto* geoid = app.add_subcommand("geoid", "Geoids that heights can stand on.");
  geoid->require_subcommand(1);
  auto* geoid_import = geoid->add_subcommand(
      "import", "Bring in EGM2008, for vertical_datum = \"egm2008\"; EGM96 is always there.");
  geoid_import
      ->add_option("FILE", args.file,
                   "Und_min2.5x2.5_egm2008_WGS84_TideFree_reformatted of the program GEOTRANS "
                   "(Debian package geotranz).")
      ->required();
  geoid_import->add_option("--out", args.out,
                           "Folder to write to; left out: where worlds look for it.");
  geoid_import->callback([&] { status = run_geoid_import(args); });

  auto* list = app.add_subcommand("list", "What this build knows, one name a line.");
  list->add_option("WHAT", args.name, "One of " + joined(listable_names()) + ".")->required();
  list->callback([&] { fmt::print("{}", list_text(args.name)); });

  auto* config = app.add_subcommand("config", "Explain or resolve configs.");
  config->require_subcommand(1);
  auto* explain = config->add_subcommand("explain", "Every key, or those whose name contains KEY.");
  explain->add_option("KEY", args.name, "A key or a part of one.");
  explain->callback([&] { fmt::print("{}", explain_text(args.name)); });
  auto* resolve = config->add_subcommand(
      "resolve", "A config with everything it extends, includes and leaves to defaults.");
  add_config(*resolve, args);
  resolve->callback(
      [&] { fmt::print("{}", core::toml_text(job::load_run_config(args.config, args.sets))); });

  auto* docs = app.add_subcommand("docs", "Write a page of the reference.");
  docs->add_option("PAGE", args.name, "config: the keys of configs (default); classes; sources.")
      ->check(CLI::IsMember({"config", "classes", "sources"}));
  docs->add_option("-o,--output", args.file, "The Markdown file to write.")->required();
  docs->callback([&] {
    core::write_file(args.file, args.name == "classes"   ? classes_page()
                                : args.name == "sources" ? sources_page()
                                                         : reference_text());
  });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int printed = app.exit(error);
    return printed == 0 ? 0 : core::exit_status(ErrorKind::Usage);
  }
  return status;
}

/// " (thrown by plug-in …)", where the last exception came out of one.
std::string thrown_by() {
  const std::string thrower = plugins::thrower_of_current_exception();
  return thrower.empty() ? "" : fmt::format(" (thrown by {})", thrower);
}

/// Text of a plug-in as it may stand on a terminal; ends of lines stay. Beside it stands text that is printable() already.
std::string without_control_characters(std::string_view text) {
  std::string words;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x20 && c != '\n') || byte == 0x7f)
      words += fmt::format("\\x{:02x}", byte);
    else
      words += c;
  }
  return words;
}

/// The words of the exception that is being handled. An Internal error that was thrown below a plug-in's function, by that or
/// by what it called, names the plug-in.
std::string words_of(const core::Error& error) {
  const std::string thrower = plugins::thrower_of_current_exception();
  if (thrower.empty()) return error.what();
  return without_control_characters(error.what()) +
         (error.kind() == ErrorKind::Internal ? fmt::format("\n  in a call from {}", thrower) : "");
}

/// Names whose bug an unexpected exception is.
std::string whose_bug() {
  const std::string thrower = plugins::thrower_of_current_exception();
  return thrower.empty() ? "this is a bug of terracast"
                         : fmt::format("this is a bug of {}", thrower);
}

/// cause  of the system; "": it is memory alone
int say_out_of_memory(const std::string& cause) {
  fmt::print(stderr,
             "error: out of memory{}{}; lower tracing.memory_bytes or the number of threads "
             "(--threads), or let the process have more (ulimit -v, ulimit -u)\n",
             cause.empty() ? "" : fmt::format(" or threads ({})", core::printable(cause)),
             thrown_by());
  return core::exit_status(ErrorKind::Io);
}

}  // namespace

int run_command_line(int argc, const char* const* argv) {
  const plugins::AtWork at_work;
  try {
    const std::vector<const char*> others = load_named_plugins(argc, argv);
    const int status = parse_and_run(static_cast<int>(others.size()), others.data());
    if (std::fflush(stdout) != 0)
      fail(ErrorKind::Io, "standard output: cannot be written: {}",
           std::generic_category().message(errno));
    return status;
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Interrupted)
      fmt::print(stderr, "{}\n", error.message());
    else
      fmt::print(stderr, "error: {}\n", words_of(error));
    return core::exit_status(error.kind());
  } catch (const std::bad_alloc&) {
    return say_out_of_memory("");
  } catch (const std::system_error& error) {  // of the file system, of a print, or of a thread
    if (error.code() == std::errc::resource_unavailable_try_again ||
        error.code() == std::errc::not_enough_memory)
      return say_out_of_memory(error.what());
    fmt::print(stderr, "error: {}{}\n", error.what(), thrown_by());
    return core::exit_status(ErrorKind::Io);
  } catch (const std::exception& error) {
    // TBB throws this when it cannot start a thread.
    if (std::string_view(error.what()).find("pthread_create") != std::string_view::npos)
      return say_out_of_memory(error.what());
    fmt::print(stderr, "error: {} ({})\n", core::printable(error.what()), whose_bug());
    return core::exit_status(ErrorKind::Internal);
  } catch (...) {  // plug-ins may throw anything
    fmt::print(stderr, "error: an object that is no std::exception was thrown ({})\n", whose_bug());
    return core::exit_status(ErrorKind::Internal);
  }
}

}  // namespace terracast::cli
