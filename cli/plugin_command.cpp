#include "cli/plugin_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "cli/within.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "plugins/blame.h"
#include "plugins/loader.h"
#include "plugins/plugin_check.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using plugins::KindVerdict;
using plugins::LawTried;

struct Arguments {
  fs::path file;
  std::vector<std::string> keys;
  plugins::CheckOptions options;
  bool is_verbose = false;
};

void print_verdict(const KindVerdict& verdict, bool is_verbose) {
  fmt::print("{:9} {}: {}\n", verdict.kind.type, verdict.kind.name,
             verdict.is_kept() ? fmt::format("keeps {} laws", verdict.laws.size()) : "REFUSED");
  for (const LawTried& law : verdict.laws)
    if (!law.broken.empty())
      fmt::print("    broken: {}\n            {}\n", law.law, law.broken);
    else if (is_verbose)
      fmt::print("    holds:  {}\n", law.law);
  if (!verdict.ended.empty())
    fmt::print("    {}\n", verdict.laws.empty()
                               ? verdict.ended
                               : fmt::format("at \"{}\":\n            {}", verdict.laws.back().law,
                                             verdict.ended));
  std::fflush(stdout);
}

int run_list() {
  if (core::plugins().empty()) fmt::print("no plug-in is loaded\n");
  for (const core::Plugin& plugin : core::plugins()) {
    fmt::print("{} {} ({}): {}\n", plugin.name, plugin.version, plugin.licence,
               plugin.file.string());
    for (const plugins::KindInPlugin& kind : plugins::kinds_in_plugins())
      if (kind.name.starts_with(plugin.name + "."))
        fmt::print("    {:9} {:22} {}\n", kind.type, kind.name, kind.summary);
  }
  return 0;
}

int run_check(Arguments& args) {
  args.options.plugin = plugins::load_plugin(args.file);
  for (const std::string& pair : args.keys) {
    const std::size_t equal = pair.find('=');
    if (equal == std::string::npos)
      fail(ErrorKind::Usage, "--keys {}: write KIND=FILE, as --keys mine.laser=laser.toml", pair);
    const std::string kind = pair.substr(0, equal);
    const std::string file = pair.substr(equal + 1);
    if (!args.options.keys.emplace(kind, plugins::KindKeys{core::read_text_file(file), file})
             .second)
      fail(ErrorKind::Usage, "--keys: keys of {} are given twice; write them into one file", kind);
  }
  const std::vector<KindVerdict> verdicts = check_plugins(
      args.options, [&](const KindVerdict& verdict) { print_verdict(verdict, args.is_verbose); });
  std::string refused;
  for (const KindVerdict& verdict : verdicts)
    if (!verdict.is_kept())
      refused += fmt::format("{}{}", refused.empty() ? "" : ", ", verdict.kind.name);
  if (refused.empty())
    fmt::print("{}: every law holds\n", args.file.string());
  else
    fmt::print("{}: refused for {}\n", args.file.string(), refused);
  return refused.empty() ? 0 : 1;
}

/// Loads the plug-ins of a path. One that cannot be loaded is left out with a warning: this command may not need it, and a
/// config that does says so.
void load_from_path(const char* folders) {
  for (const plugins::FoundPlugin& found : plugins::plugins_on_path(folders)) {
    if (!found.problem.empty()) {
      fmt::print(stderr, "warning: TERRACAST_PLUGIN_PATH: {}\n", found.problem);
      continue;
    }
    try {
      plugins::load_plugin(found.file);
    } catch (const core::Error& error) {
      fmt::print(stderr, "warning: TERRACAST_PLUGIN_PATH: {}\n", error.what());
    }
  }
}

}  // namespace

std::vector<const char*> load_named_plugins(int argc, const char* const* argv) {
  constexpr std::string_view kOption = "--plugin";
  std::vector<fs::path> files;
  std::vector<const char*> others;
  for (int i = 0; i < argc; ++i) {
    const std::string_view word = argv[i];
    if ((word == kOption && i + 1 == argc) || word == "--plugin=")
      fail(ErrorKind::Usage, "--plugin needs a file; write --plugin FILE");
    if (word == kOption)
      files.emplace_back(argv[++i]);
    else if (word.starts_with("--plugin="))
      files.emplace_back(word.substr(kOption.size() + 1));
    else
      others.push_back(argv[i]);
  }
  plugins::name_plugins_in_crashes();
  for (const fs::path& file : files) plugins::load_plugin(file);
  // A check is of one file, whatever is installed.
  const bool is_check = others.size() > 2 && std::string_view(others[1]) == "plugin" &&
                        std::string_view(others[2]) == "check";
  if (const char* folders = std::getenv("TERRACAST_PLUGIN_PATH"); folders != nullptr && !is_check)
    load_from_path(folders);
  return others;
}

void add_plugin_command(CLI::App& app, int& status) {
  auto args = std::make_shared<Arguments>();
  auto* plugin = app.add_subcommand("plugin", "Plug-ins: what is loaded, and whether it is right.");
  plugin->require_subcommand(1);
  plugin->add_subcommand("list", "The loaded plug-ins, and what they add.")->callback([&status] {
    status = run_list();
  });
  auto* check = plugin->add_subcommand(
      "check",
      "Try the laws of every kind that a plug-in adds, each in a process of its own; exit status 1 "
      "when one is broken.");
  check->add_option("FILE", args->file, "The plug-in, a file NAME.so.")->required();
  check
      ->add_option("--keys", args->keys,
                   "A TOML file with keys of a kind, as they stand in a config: those without a "
                   "default, and others to try the laws with (repeatable).")
      ->type_name("KIND=FILE")
      ->allow_extra_args(false);
  check
      ->add_option("--limit", args->options.limit_s,
                   "Seconds that the laws of one kind may take; what takes longer hangs.")
      ->check(within(1.0, 86400.0));
  check->add_option(
      "--folder", args->options.folder,
      "An empty folder for the worlds and datasets that are made, which are kept; left "
      "out: a temporary one.");
  check->add_flag("-v,--verbose", args->is_verbose, "Name the laws that hold too.");
  check->callback([args, &status] { status = run_check(*args); });
}

}  // namespace terracast::cli
