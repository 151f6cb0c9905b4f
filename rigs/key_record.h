#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/ledger.h"

namespace terracast::rigs {

/// The keys of a document's maps that a reader looked into, and those of them that it took: what it took is used, and
/// what nobody took stands in the ledger without that the reader names it.
class KeyRecord {
 public:
  /// From the document's root: keys, and "[3]" for the item of a list.
  using Path = std::vector<std::string>;

  /// A map that a reader looks into.
  /// throws   Input: a key stands twice; `where` names the map
  void open(const Path& map, const std::vector<std::string>& keys, const std::string& where);
  bool is_open(const Path& map) const { return maps_.contains(map); }
  void take(const Path& key) { taken_.insert(key); }
  /// Taken, but nothing can be made of it: counted as ignored, not as used.
  void pass_over(const Path& key, const std::string& why) { passed_over_[key] = why; }
  /// A part of what was taken is of no use.
  void leave_out(const Path& key, const std::string& part, const std::string& why);
  /// A value that contradicts another one.
  void misunderstand(const Path& key, const std::string& value);

  /// A key's name for the ledger: "cameras[].name" of ["cameras", "[3]", "name"].
  static std::string name_of(const Path& path);
  /// The same with N for the number in the first key: "camN.intrinsics" of ["cam0", "intrinsics"].
  static std::string numbered_name_of(const Path& path);

  /// Every key of the maps that were looked into: used where it was taken, ignored or unknown by `known` otherwise.
  core::Ledger ledger(std::span<const core::KnownName> known,
                      std::string (*name)(const Path&) = name_of) const;

 private:
  std::map<Path, std::vector<std::string>> maps_;
  std::set<Path> taken_;
  std::map<Path, std::string> passed_over_;
  std::map<Path, std::vector<std::pair<std::string, std::string>>> parts_;
  std::map<Path, std::vector<std::string>> misunderstood_;
};

}  // namespace terracast::rigs
