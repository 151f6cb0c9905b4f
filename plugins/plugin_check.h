#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "plugins/law_report.h"
#include "plugins/loader.h"

namespace terracast::plugins {

/// Keys of a kind as they stand in a config.
struct KindKeys {
  std::string toml;
  std::string file;  ///< that holds them, in messages
};

struct CheckOptions {
  std::string plugin;  ///< its name; the kinds of others are left alone
  /// By a kind's name: keys without a default, and others that the laws shall be tried with. A camera is tried with them
  /// beside its defaults.
  std::map<std::string, KindKeys> keys;
  double limit_s = 120.0;  ///< of wall time for the laws of one kind; what takes longer hangs
  /// Where worlds and datasets are made; empty: a folder of its own in the system's for temporary files, gone at the end.
  std::filesystem::path folder;
};

/// What the laws found of one kind.
struct KindVerdict {
  KindInPlugin kind;
  std::vector<LawTried> laws;
  std::string
      ended;  ///< why the laws were not tried to the end: "throws …", "crashed …", "hangs …"; empty: they were

  bool is_kept() const;
};

/// Tries the laws of every kind that a loaded plug-in adds, each in a process of its own: what throws, crashes or hangs
/// is named, and the others are tried all the same.
/// told     of each kind when its laws have been tried
/// throws   Config: keys of a kind that the plug-in has not, or that do not fit the kind; Io
/// threads  the process must have started no thread yet: it forks
std::vector<KindVerdict> check_plugins(const CheckOptions& options,
                                       const std::function<void(const KindVerdict&)>& told);

}  // namespace terracast::plugins
