#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/json.h"

/// What files from outside say, and what became of it: nothing of it goes by unseen.
namespace terracast::core {

/// What a reader makes of a tag, key, attribute or element.
struct KnownName {
  std::string_view name;   ///< "height"; a star at its end stands for any letters: "addr:*"
  std::string_view words;  ///< of one that is used: what it decides; of one that is not: why
  bool is_used = true;
};

/// What a reader knows, for the documentation.
struct KnownTable {
  std::string_view reader;  ///< "buildings", "kalibr"
  std::string_view what;    ///< "tags of features", "keys of a camera"
  std::span<const KnownName> names;
};

/// The entry of a table that a name is; of several the first. nullptr: it is not known.
const KnownName* find_known(std::span<const KnownName> known, std::string_view name);

/// Counts of the names that a reader met, by what became of them. A file may state any number of names: the first
/// thousand by the alphabet are kept, the others counted together.
/// determinism  the same whatever the order in which names are met and ledgers are merged
/// threads      not safe; each thread has its own, which are merged
class Ledger {
 public:
  struct Entry {
    std::int64_t num_used = 0;
    std::int64_t num_ignored = 0;
    std::int64_t num_unknown = 0;
    std::string why;  ///< it was ignored
    /// Values that were not understood, by how often they stood there; the first twenty by the alphabet.
    std::map<std::string, std::int64_t> not_understood;
    std::int64_t num_other_values = 0;  ///< of more values

    std::int64_t num_not_understood() const;
  };

  /// Used, ignored or unknown, by what a reader knows.
  void count(std::string_view name, std::span<const KnownName> known, std::int64_t times = 1);
  void use(std::string_view name, std::int64_t times = 1);
  void ignore(std::string_view name, std::string_view why, std::int64_t times = 1);
  void miss(std::string_view name, std::int64_t times = 1);  ///< it is unknown
  /// A value of a name that is used, of which nothing could be made.
  void misunderstand(std::string_view name, std::string_view value, std::int64_t times = 1);
  void merge(const Ledger& other);

  bool is_empty() const { return entries_.empty(); }
  /// By name, as core::printable() has it.
  const std::map<std::string, Entry>& entries() const { return entries_; }
  std::int64_t num_of_others() const { return num_of_others_; }

  /// What is unknown and what was not understood, a line each, the most frequent first.
  std::vector<std::string> warnings(std::size_t most_lines = 100) const;
  /// A table for a terminal: a line for each name.
  std::string table() const;

  Json json() const;
  /// throws   Input: not written by json()
  static Ledger of(const Json& json);
  bool operator==(const Ledger& other) const;

 private:
  Entry& entry(std::string_view name);
  void leave_out_the_last();

  std::map<std::string, Entry> entries_;
  std::int64_t num_of_others_ = 0;  ///< times of names beyond those that are kept
};

}  // namespace terracast::core
