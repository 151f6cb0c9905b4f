#include "tests/support/cluster_simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "batch/board.h"
#include "core/random.h"
#include "tests/support/cluster_job.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

constexpr std::uint64_t kSeed = 17;

/// Shards that wait for nothing.
SimulatedJob job_of_equal(int count, const SimulatedShard& shard) {
  SimulatedJob job;
  job.stages.emplace_back(static_cast<std::size_t>(count), shard);
  return job;
}

/// So many runs with tiles, three renders, an export and its report each, and a merge; costs drawn.
SimulatedJob job_of_runs(int num_runs) {
  SimulatedJob job;
  job.stages.resize(5);
  job.num_gates = 3 * num_runs + 1;
  std::uint64_t count = 0;
  const auto add = [&](std::size_t stage, double most_s, int waits_for, std::array<int, 2> serves) {
    job.stages[stage].push_back(
        {.cpu_s = core::random_between(0.1, 1.0, kSeed, 0, ++count) * most_s,
         .operations = 100.0,
         .read_bytes = 1e6,
         .written_bytes = 1e6,
         .waits_for = waits_for,
         .serves = serves});
  };
  const int merge = 3 * num_runs;
  for (int run = 0; run < num_runs; ++run) {
    add(0, 10.0, -1, {3 * run, -1});
    for (int i = 0; i < 3; ++i) add(1, 100.0, 3 * run, {3 * run + 1, -1});
    add(2, 10.0, 3 * run + 1, {3 * run + 2, merge});
    add(3, 10.0, 3 * run + 2, {merge, -1});
  }
  add(4, 10.0, merge, {-1, -1});
  return job;
}

TEST(ClusterSimulation, OneWorkerTakesTheSumOfAllShards) {
  const SimulatedJob job = job_of_runs(20);
  for (const Dealing dealing : {Dealing::Pool, Dealing::PoolFromFirst, Dealing::Arrays}) {
    const SimulatedOutcome outcome =
        simulate(job, {.num_workers = 1, .dealing = dealing, .task_s = 1e9});
    EXPECT_NEAR(outcome.makespan_s, job.cpu_s(), 1e-9 * job.cpu_s());
    EXPECT_NEAR(outcome.efficiency({.num_workers = 1}), 1.0, 1e-9);
    EXPECT_EQ(outcome.num_tries, 20 * 6 + 1);
  }
}

TEST(ClusterSimulation, EqualShardsTakeAsManyRoundsAsTheirNumberOverTheWorkers) {
  for (const int num_shards : {1, 7, 64, 65, 1000}) {
    for (const int num_workers : {1, 2, 7, 64}) {
      const int num_rounds = (num_shards + num_workers - 1) / num_workers;
      for (const Dealing dealing : {Dealing::Pool, Dealing::PoolFromFirst})
        EXPECT_NEAR(simulate(job_of_equal(num_shards, {.cpu_s = 3.0}),
                             {.num_workers = num_workers, .dealing = dealing})
                        .makespan_s,
                    3.0 * num_rounds, 1e-9)
            << num_shards << " shards, " << num_workers << " workers";
    }
  }
}

TEST(ClusterSimulation, ArraysTakeRoundsOfTasksWithAStartEach) {
  // 100 shards of 3 s in tasks of 30 s: ten, on four workers three rounds of 2 + 10 times 3 s.
  const SimulatedOutcome outcome =
      simulate(job_of_equal(100, {.cpu_s = 3.0}),
               {.num_workers = 4, .dealing = Dealing::Arrays, .task_s = 30.0, .start_s = 2.0});
  EXPECT_NEAR(outcome.makespan_s, 3 * (2.0 + 30.0), 1e-9);
  EXPECT_NEAR(outcome.starting_s, 10 * 2.0, 1e-9);
}

TEST(ClusterSimulation, NoScheduleBeatsTheLongestChainOrTheSumOverTheWorkers) {
  const SimulatedJob job = job_of_runs(50);
  // Pick by hand: tiles, the longest render, export and report of each run, and the merge.
  double longest_s = 0.0;
  for (std::size_t run = 0; run < 50; ++run) {
    double render_s = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
      render_s = std::max(render_s, job.stages[1][3 * run + i].cpu_s);
    longest_s = std::max(longest_s, job.stages[0][run].cpu_s + render_s + job.stages[2][run].cpu_s +
                                        job.stages[3][run].cpu_s);
  }
  longest_s += job.stages[4][0].cpu_s;
  EXPECT_NEAR(job.critical_path_s(), longest_s, 1e-9);
  for (const int num_workers : {1, 3, 10, 100, 1000}) {
    for (const Dealing dealing : {Dealing::Pool, Dealing::Arrays}) {
      const double makespan_s =
          simulate(job, {.num_workers = num_workers, .dealing = dealing, .task_s = 100.0})
              .makespan_s;
      EXPECT_GE(makespan_s, std::max(longest_s, job.cpu_s() / num_workers) - 1e-9);
      // List scheduling is within a factor of two of both (Graham 1966); the pool wakes within 3 s.
      if (dealing == Dealing::Pool) {
        EXPECT_LE(makespan_s, longest_s + job.cpu_s() / num_workers + 5 * 3.0);
      }
    }
  }
}

TEST(ClusterSimulation, TheMetadataServerBoundsTheMakespanFromBelowAndIsReached) {
  const SimulatedJob job = job_of_equal(1000, {.cpu_s = 1.0, .operations = 1000.0});
  const SimulatedOutcome outcome =
      simulate(job, {.num_workers = 500, .operations_per_s = 5000.0, .operation_s = 0.0});
  // In the end many look for what is not there, and are not waited for.
  const double needed = outcome.work_operations + outcome.claim_operations;
  EXPECT_GE(needed, 1e6);
  EXPECT_GE(outcome.makespan_s, needed / 5000.0);
  // It serves next to nothing while the last compute, 1 s; looks and renewals take 1 %.
  EXPECT_LE(outcome.makespan_s, 1.01 * needed / 5000.0 + 2.0);
  EXPECT_EQ(bound_of(outcome, job, {.num_workers = 500}), "metadata");
}

TEST(ClusterSimulation, OperationsOfOneWorkerTakeTheirWayToAndFroEach) {
  const SimulatedOutcome outcome = simulate(job_of_equal(10, {.operations = 1000.0}),
                                            {.operations_per_s = 1e6, .operation_s = 0.001});
  // Renewals are the server's load, and no worker waits for them: there is none in 1 s.
  EXPECT_NEAR(outcome.makespan_s, 0.001 * outcome.operations(), 1e-6);
}

TEST(ClusterSimulation, TheFileSystemsBandwidthIsSharedAndReached) {
  const SimulatedJob job = job_of_equal(100, {.read_bytes = 2e9, .written_bytes = 3e9});
  EXPECT_NEAR(simulate(job, {.num_workers = 50, .bytes_per_s = 1e9}).makespan_s, 500.0, 1e-6);
  // So do the nodes: 500 GB through five of 1 GB/s.
  EXPECT_NEAR(simulate(job, {.num_workers = 50, .workers_per_node = 10, .node_bytes_per_s = 1e9})
                  .makespan_s,
              100.0, 1e-6);
}

TEST(ClusterSimulation, WithExponentialFailuresTriesFromNothingGrowAsTheExponential) {
  // A try of t succeeds with exp(-f t), whatever was before: exp(f t) tries.
  constexpr int kShards = 20000;
  constexpr double kShard_s = 100.0;
  for (const double failures : {0.1, 0.7}) {
    const SimulatedOutcome outcome =
        simulate(job_of_equal(kShards, {.cpu_s = kShard_s}), {.num_workers = 10,
                                                              .workers_per_node = 1,
                                                              .node_mtbf_s = kShard_s / failures,
                                                              .repair_s = 0.0,
                                                              .lease_s = 1.0,
                                                              .max_tries = 1000,
                                                              .seed = kSeed});
    // Geometric with success p: the variance of its number is (1 - p) / p^2. Four standard deviations.
    const double p = std::exp(-failures);
    const double tolerance = 4.0 * std::sqrt((1.0 - p) / (p * p) / kShards);
    EXPECT_NEAR(static_cast<double>(outcome.num_tries) / kShards, 1.0 / p, tolerance);
    EXPECT_EQ(outcome.num_tries, kShards + outcome.num_lost);
    EXPECT_NEAR(outcome.useful_s, kShards * kShard_s, 1e-3);
  }
}

TEST(ClusterSimulation, WithExponentialFailuresFinishedFramesAreKept) {
  // Each of 50 frames of 2 s fails exp(f 2 s) - 1 times before it is done.
  constexpr int kShards = 5000;
  constexpr double kFailures_per_s = 0.01;
  const SimulatedOutcome outcome =
      simulate(job_of_equal(kShards, {.cpu_s = 100.0, .num_frames = 50}),
               {.num_workers = 10,
                .workers_per_node = 1,
                .node_mtbf_s = 1.0 / kFailures_per_s,
                .repair_s = 0.0,
                .lease_s = 1.0,
                .max_tries = 1000,
                .seed = kSeed});
  const double p = std::exp(-2.0 * kFailures_per_s);
  const double expected = 1.0 + 50.0 * (1.0 / p - 1.0);
  const double tolerance = 4.0 * std::sqrt(50.0 * (1.0 - p) / (p * p) / kShards);
  EXPECT_NEAR(static_cast<double>(outcome.num_tries) / kShards, expected, tolerance);
  EXPECT_NEAR(outcome.useful_s, kShards * 100.0, 1e-3);
  // What is lost is the frame at hand: 1 s of 2 in the mean, a little less as failures thin out.
  EXPECT_NEAR(outcome.lost_s / static_cast<double>(outcome.num_lost), 1.0, 0.05);
}

TEST(ClusterSimulation, AShardThatIsLostTooOftenIsGivenUpWithAllThatWaitsForIt) {
  SimulatedJob job = job_of_equal(1, {.cpu_s = 1e6, .serves = {0, -1}});
  job.stages.push_back({{.cpu_s = 1.0, .waits_for = 0, .serves = {1, -1}}});
  job.stages.push_back({{.cpu_s = 1.0, .waits_for = 1}, {.cpu_s = 1.0}});
  job.num_gates = 2;
  for (const Dealing dealing : {Dealing::Pool, Dealing::Arrays}) {
    const SimulatedOutcome outcome = simulate(job, {.workers_per_node = 1,
                                                    .dealing = dealing,
                                                    .node_mtbf_s = 1000.0,
                                                    .max_tries = 3,
                                                    .seed = kSeed});
    EXPECT_EQ(outcome.num_given_up, 3);
    EXPECT_EQ(outcome.num_lost, 3);
    EXPECT_EQ(outcome.num_tries, 4);
  }
}

TEST(ClusterSimulation, WhatANodeHeldIsAnothersWhenItsLeaseHasRunOut) {
  // Two workers, a shard each; the first node to fail is gone for good, the other does its shard too.
  SimulatedCluster cluster{.num_workers = 2,
                           .workers_per_node = 1,
                           .node_mtbf_s = 5000.0,
                           .repair_s = 1e9,
                           .lease_s = 600.0};
  const auto fails_s = [&](std::uint64_t node) {
    return -5000.0 *
           std::log1p(-core::random_unit(cluster.seed, core::stream_of(0x6661696c, node), 1));
  };
  // The first seed of which one fails early, and the other late.
  while (std::min(fails_s(0), fails_s(1)) > 1000.0 || std::max(fails_s(0), fails_s(1)) < 3000.0)
    ++cluster.seed;
  const SimulatedOutcome outcome = simulate(job_of_equal(2, {.cpu_s = 1000.0}), cluster);
  // Renewed every 100 s.
  const double free_s =
      std::floor(std::min(fails_s(0), fails_s(1)) / 100.0) * 100.0 + cluster.lease_s;
  const double begin_s = std::max(free_s, 1000.0);
  EXPECT_GE(outcome.makespan_s, begin_s + 1000.0);
  EXPECT_LE(outcome.makespan_s, begin_s + 1000.0 + operations::kLongestWait_s);
}

TEST(ClusterSimulation, SlowNodesTakeTheirFactor) {
  const SimulatedOutcome outcome =
      simulate(job_of_equal(10, {.cpu_s = 5.0}), {.slow_share = 1.0, .slow_factor = 3.0});
  EXPECT_NEAR(outcome.makespan_s, 150.0, 1e-9);
  EXPECT_NEAR(outcome.slow_s, 100.0, 1e-9);
}

TEST(ClusterSimulation, WhoAllBeginAtTheFirstShardLookAtWhatOthersHold) {
  constexpr int kWorkers = 40;
  constexpr double kPairs = kWorkers * (kWorkers - 1) / 2.0;
  const SimulatedJob job = job_of_equal(kWorkers, {.cpu_s = 10.0});
  const auto looks = [&](Dealing dealing) {
    return simulate(job, {.num_workers = kWorkers, .dealing = dealing, .operations_per_s = 1e9})
        .look_operations;
  };
  // Each finds its own free, and in the end all that are done and held by then; the last ends the job.
  const double of_pool = kWorkers * (operations::kTurn + operations::kLookAtFree) +
                         (kWorkers - 1) * operations::kTurn +
                         kPairs * (operations::kLookAtDone + operations::kLookAtHeld);
  // Waiting 10 microseconds at a time asks for next to nothing.
  EXPECT_NEAR(looks(Dealing::Pool), of_pool, 0.5);
  // Worker k finds k held in its way, one after the other, and each time another that seems free.
  EXPECT_NEAR(looks(Dealing::PoolFromFirst),
              of_pool + kPairs * (operations::kLookAtHeld + operations::kLookAtFree), 0.5);
}

TEST(ClusterSimulation, TheSameSeedGivesTheSameOutcome) {
  const SimulatedJob job = job_of_runs(200);
  SimulatedCluster cluster{.num_workers = 60,
                           .workers_per_node = 8,
                           .operations_per_s = 1000.0,
                           .operation_s = 0.001,
                           .bytes_per_s = 1e7,
                           .node_mtbf_s = 2000.0,
                           .seed = kSeed};
  const SimulatedOutcome first = simulate(job, cluster);
  const SimulatedOutcome second = simulate(job, cluster);
  EXPECT_EQ(first.makespan_s, second.makespan_s);
  EXPECT_EQ(first.look_operations, second.look_operations);
  cluster.seed = kSeed + 1;
  EXPECT_NE(simulate(job, cluster).makespan_s, first.makespan_s);
  // All time of all workers is somewhere.
  EXPECT_NEAR(first.useful_s + first.starting_s + first.slow_s + first.asking_s + first.moving_s +
                  first.lost_s + first.idle_s,
              60 * first.makespan_s, 1e-6 * 60 * first.makespan_s);
  EXPECT_NEAR(first.useful_s, job.cpu_s(), 1e-6 * job.cpu_s());
}

/// Three runs: one of two formats, one of one, one of none.
batch::Plan small_plan() {
  batch::Plan plan;
  plan.shards.resize(batch::kStages.size());
  for (int run = 0; run < 3; ++run) {
    batch::PlannedRun planned;
    for (int format = run; format < 2; ++format)
      planned.formats.push_back({format == 0 ? "kitti" : "colmap", ""});
    plan.runs.push_back(planned);
  }
  const auto add = [&](batch::Stage stage, const batch::Piece& piece) {
    auto& shards = plan.shards[static_cast<std::size_t>(stage)];
    shards.push_back(
        {.id = {stage, static_cast<int>(shards.size())}, .pieces = {piece}, .cost = {}});
  };
  for (const int run : {2, 0, 1}) {
    add(batch::Stage::Tile, {.run = run});
    for (int i = 0; i < 2 + run; ++i)
      add(batch::Stage::Render, {.run = run, .first_frame = i, .end_frame = i + 1});
    for (int format = 0; format < 2 - run; ++format) {
      add(batch::Stage::Export, {.run = run, .format = format});
      add(batch::Stage::Validate, {.run = run, .format = format});
    }
  }
  plan.shards.back().push_back({.id = {batch::Stage::Merge, 0}, .pieces = {}, .cost = {}});
  return plan;
}

TEST(ClusterJob, ShardsWaitForWhatTheBoardSaysTheyNeed) {
  const batch::Plan plan = small_plan();
  const SimulatedJob job = job_of(plan);
  const ScratchFolder folder;
  const batch::Claims claims(folder.path(), {});
  for (std::uint64_t order = 0; order < 20; ++order) {
    batch::Board board(plan, claims);
    std::vector<int> missing(static_cast<std::size_t>(job.num_gates), 0);
    std::vector<batch::ShardId> left;
    for (const auto& shards : plan.shards)
      for (const batch::Shard& shard : shards) left.push_back(shard.id);
    const auto simulated = [&](const batch::ShardId& id) {
      return job.stages[static_cast<std::size_t>(id.stage)][static_cast<std::size_t>(id.index)];
    };
    for (const batch::ShardId& id : left)
      for (const int gate : simulated(id).serves)
        if (gate >= 0) ++missing[static_cast<std::size_t>(gate)];
    while (!left.empty()) {
      std::vector<batch::ShardId> ready;
      for (const batch::ShardId& id : left) {
        const int gate = simulated(id).waits_for;
        const bool is_open = gate < 0 || missing[static_cast<std::size_t>(gate)] == 0;
        EXPECT_EQ(is_open, board.is_ready(id)) << id.text();
        if (is_open) ready.push_back(id);
      }
      ASSERT_FALSE(ready.empty());
      const batch::ShardId done =
          ready[core::random_bits(kSeed, order, left.size()) % ready.size()];
      board.set_done(done);
      std::erase(left, done);
      for (const int gate : simulated(done).serves)
        if (gate >= 0) --missing[static_cast<std::size_t>(gate)];
    }
  }
}

}  // namespace
}  // namespace terracast::test
