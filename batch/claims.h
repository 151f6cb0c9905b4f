#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "batch/stage.h"
#include "core/json.h"

namespace terracast::batch {

/// How a try at a shard ended.
struct TryEnd {
  enum class How {
    Failed,    ///< with an error; it counts
    Released,  ///< the process was asked to end; it does not count
    Lost,      ///< its process is gone, or has not been heard of for a lease; it counts
  };
  How how = How::Failed;
  std::string error;   ///< of a failed one
  std::string worker;  ///< machine and process
};

struct ClaimOptions {
  double lease_s =
      300.0;          ///< a claim of ours that was not renewed for so long is another's to take
  int max_tries = 5;  ///< as many tries that count make a shard poisoned
};

/// A right to work on a shard, renewed in the background while it lives. It avoids work that is done
/// twice; nothing depends on it: two workers that both hold one write the same bytes.
class Claim {
 public:
  Claim(Claim&&) noexcept;
  Claim& operator=(Claim&&) noexcept;
  ~Claim();  ///< as release()

  ShardId shard() const;
  /// Puts the shard's record in place, unless a twin has done so, and takes this process's claims of
  /// it back.
  /// throws Io
  void commit(const core::Json& record);
  /// Leaves the error for the others to see.
  void fail(const std::string& error);
  /// Gives the shard back, untried.
  void release();

 private:
  friend class Claims;
  struct Impl;
  explicit Claim(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Claims and records of a job's shards: small files in a folder that all workers see.
///
///     done/render/000/000012.json        the shard is done
///     claims/render/000012.1             the first try: who holds it; its time of change is the lease
///     claims/render/000012.1.end         how it ended
///
/// A claim is made by link(), which fails where the name exists: of several workers one gets it. The
/// next try takes the next number: while a shard is open no name is used again, and a claim cannot be
/// taken from somebody who has just taken it. After a shard was done and opened again numbers begin
/// anew; who slept through that may do it twice, to the same bytes. Ages are differences of times that the file system gave: clocks
/// of machines play no part. A claim that does not change for a lease while somebody watches is lost
/// too, whatever its time of change says.
/// threads   safe
class Claims {
 public:
  /// folder   of the plan's state; made when it is not there
  Claims(std::filesystem::path folder, const ClaimOptions& options);
  ~Claims();

  enum class Standing { Free, Held, Done, Poisoned };
  Standing standing(const ShardId& shard) const;
  /// The claim, or how the shard stands that nobody may claim now.
  /// is_retry   poisoned shards too
  std::variant<Claim, Standing> claim(const ShardId& shard, bool is_retry = false);

  bool is_done(const ShardId& shard) const;
  /// Indices of the shards of a stage that are done, ascending: one listing of folders.
  std::vector<int> done(Stage stage) const;
  /// throws Input: the record is not as it was written (names it)
  core::Json record(const ShardId& shard) const;
  /// Records a shard as done that another revision of the plan has done.
  void set_done(const ShardId& shard, const core::Json& record);
  std::filesystem::path record_file(const ShardId& shard) const;
  /// Takes a shard's record back, where there is one: its results were found wanting. No earlier try
  /// counts any more.
  /// throws Io
  void reopen(const ShardId& shard);
  /// Removes what processes that have ended left in the folder, those of other machines after a day,
  /// and calls clear(shard) before it forgets that one tried a shard.
  void clear_up(const std::function<void(const ShardId&)>& clear);

  /// A shard that somebody has tried and that is not done.
  struct Tried {
    ShardId shard;
    std::vector<TryEnd> ends;
    std::string holder;  ///< who works on it now; empty: nobody
    bool is_poisoned = false;
    std::string last_error() const;  ///< its first line; empty: none failed
  };
  std::vector<Tried> tried() const;

 private:
  friend class Claim;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terracast::batch
