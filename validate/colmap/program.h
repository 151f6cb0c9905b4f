#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace terracast::validate {

/// COLMAP is missing, or one of its commands did not do its work; what() is for the report.
struct ColmapFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A command with its options, all but the paths: what its result depends on beside its input.
struct ColmapCommand {
  std::string name;
  std::vector<std::string> options = {};

  std::string key() const;  ///< as typed
};

/// COLMAP, as installed. Written for 3.8, Debian 12's.
class ColmapProgram {
 public:
  /// logs  folder that gets a log for each command
  /// throws  ColmapFailure: not installed, or it does not start; Io
  explicit ColmapProgram(std::filesystem::path logs);

  /// The first line of its help: "COLMAP 3.8 -- …".
  const std::string& version() const { return version_; }

  /// Runs a command without a display.
  /// paths  more options, those that name files and folders
  /// log    name of the log, which is begun anew
  /// throws  ColmapFailure: it was ended, ran out of time or failed; says so with the end of its
  ///         log
  void run(const ColmapCommand& command, const std::vector<std::string>& paths,
           const std::string& log, double timeout_s) const;

 private:
  std::filesystem::path program_;
  std::filesystem::path logs_;
  std::string version_;
};

}  // namespace terracast::validate
