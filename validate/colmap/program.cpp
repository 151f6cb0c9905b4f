#include "validate/colmap/program.h"

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/program.h"
#include "validate/text.h"

namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

constexpr const char* kHelp = "help";

/// The last lines of a log that are not blank, each without control characters.
std::string end_of_log(const fs::path& log) {
  constexpr std::size_t kMostLines = 6;
  constexpr std::size_t kMostLetters = 300;
  const std::string text = core::read_text_file(log);
  std::vector<std::string> lines;
  for (const TextLine& line : split_lines(text)) {
    std::string kept;
    for (const char c : line.text.substr(0, kMostLetters))
      if (static_cast<unsigned char>(c) >= ' ') kept += c;
    if (!trimmed(kept).empty()) lines.push_back(std::move(kept));
    if (lines.size() > kMostLines) lines.erase(lines.begin());
  }
  return fmt::format("{}", fmt::join(lines, "\n"));
}

}  // namespace

std::string ColmapCommand::key() const {
  return fmt::format("colmap {} {}\n", name, fmt::join(options, " "));
}

ColmapProgram::ColmapProgram(fs::path logs) : logs_(std::move(logs)) {
  core::make_folder(logs_);
  const auto found = core::find_program("colmap");
  if (!found)
    throw ColmapFailure(
        "the program colmap is not installed; on Debian 12: apt-get install colmap");
  program_ = *found;
  constexpr double kTimeout_s = 60.0;
  run({kHelp}, {}, "help.log", kTimeout_s);
  const std::string help = core::read_text_file(logs_ / "help.log");
  for (const TextLine& line : split_lines(help))
    if (version_.empty() && line.text.starts_with("COLMAP")) version_ = line.text.substr(0, 200);
  if (version_.empty())
    throw ColmapFailure(
        fmt::format("{} is not COLMAP: its help does not say so", program_.string()));
}

void ColmapProgram::run(const ColmapCommand& command, const std::vector<std::string>& paths,
                        const std::string& log, double timeout_s) const {
  std::vector<std::string> words{command.name};
  words.insert(words.end(), paths.begin(), paths.end());
  words.insert(words.end(), command.options.begin(), command.options.end());
  const fs::path log_file = logs_ / log;
  core::write_file(
      log_file, command.name == kHelp ? "" : fmt::format("colmap {}\n\n", fmt::join(words, " ")));
  const core::ProgramEnd end =
      core::run_program(program_, words, log_file,
                        {.timeout_s = timeout_s, .environment = {"QT_QPA_PLATFORM=offscreen"}});
  if (end.is_success()) return;
  throw ColmapFailure(fmt::format("colmap {} {}{}; {} ends with:\n{}", command.name, end.text(),
                                  version_.empty() ? "" : " (" + version_ + "; written for 3.8)",
                                  log, end_of_log(log_file)));
}

}  // namespace terracast::validate
