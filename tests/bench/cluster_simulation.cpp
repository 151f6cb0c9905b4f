// How a batch scales: plays a planned job on clusters of 1 to 10 000 workers, with what shards were
// measured to cost.
//
//     terracast batch plan CONFIG --out MEASURED && terracast batch run MEASURED --threads 1
//     terracast batch plan LARGE_CONFIG --out LARGE
//     build/bench/terracast_cluster MEASURED --plan LARGE --figure efficiency.svg
//
// MEASURED is a batch that was run: its records say what shards cost over what was planned. LARGE is
// only planned. Without --figure it plays one cluster, which the options describe. --replay plays
// MEASURED itself, each shard with its own wall time, to be held against what it took.

#include "tests/support/cluster_simulation.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/support/cluster_job.h"

namespace {

using namespace terracast;
using test::SimulatedCluster;
using test::SimulatedJob;
using test::SimulatedOutcome;

// Of the demo's batch, counted by strace (docs/cluster.md, "How far it scales").
// Tiles: of a world whose tiles are there; the planner reckons four more for each frame.
constexpr test::FileUses kUses = {{
    {.operations_per_shard = 3600.0,
     .operations_per_frame = 20.0,
     .read_bytes_per_shard = 64e6,
     .read_bytes_per_frame = 0.4e6},
    {.operations_per_shard = 950.0,
     .operations_per_frame = 180.0,
     .read_bytes_per_shard = 43e6,
     .read_bytes_per_frame = 0.3e6},
    {.operations_per_shard = 100.0,
     .operations_per_frame = 180.0,
     .read_bytes_per_shard = 0.0,
     .read_bytes_per_frame = 30e6},
    {.operations_per_shard = 270.0,
     .operations_per_frame = 190.0,
     .read_bytes_per_shard = 13e6,
     .read_bytes_per_frame = 15e6},
    {.operations_per_shard = 0.0,
     .operations_per_frame = 95.0,
     .read_bytes_per_shard = 0.0,
     .read_bytes_per_frame = 0.0},
}};

/// A file system and a cluster of a kind that there is.
struct Scenario {
  std::string name;
  std::string color;
  SimulatedCluster cluster;
  bool has_merge = false;  ///< one process, which hides what else there is
};

constexpr double kDay_s = 86400.0;

std::vector<Scenario> scenarios(const SimulatedCluster& base) {
  const auto with = [&](double operations_per_s, double operation_s, double bytes_per_s,
                        double node_bytes_per_s) {
    SimulatedCluster cluster = base;
    cluster.operations_per_s = operations_per_s;
    cluster.operation_s = operation_s;
    cluster.bytes_per_s = bytes_per_s;
    cluster.node_bytes_per_s = node_bytes_per_s;
    return cluster;
  };
  std::vector<Scenario> all = {
      {"no limits, and the merge", "#8a8f94", base, true},
      {"no limits", "#23303b", base},
      {"Lustre", "#2f6db5", with(1e5, 0.5e-3, 15e9, 1.2e9)},
      {"cloud NFS", "#3f8f5b", with(7e3, 1.6e-3, 3.2e9, 0.5e9)},
      {"one NFS server", "#b5452f", with(2e3, 1e-3, 0.11e9, 0.11e9)},
      {"no limits, nodes fail every day", "#8a5fb0", base},
  };
  all.back().cluster.node_mtbf_s = kDay_s;
  return all;
}

std::string time_text(double seconds) {
  if (seconds >= 2.0 * kDay_s) return fmt::format("{:.1f} d", seconds / kDay_s);
  if (seconds >= 7200.0) return fmt::format("{:.1f} h", seconds / 3600.0);
  return seconds >= 120.0 ? fmt::format("{:.1f} min", seconds / 60.0)
                          : fmt::format("{:.1f} s", seconds);
}

void print_header() {
  fmt::print(
      "| workers | makespan | efficiency | bound by | asking | moving | start-up | lost | idle | "
      "operations (looking) | lost tries |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
}

void print_row(const SimulatedOutcome& outcome, const SimulatedJob& job,
               const SimulatedCluster& cluster) {
  const double all_s = outcome.makespan_s * cluster.num_workers;
  const auto share = [&](double seconds) { return 100.0 * seconds / all_s; };
  fmt::print(
      "| {} | {} | {:.1f} % | {} | {:.1f} % | {:.1f} % | {:.1f} % | {:.1f} % | {:.1f} % | {:.3g} "
      "({:.0f} %) | {} |\n",
      cluster.num_workers, time_text(outcome.makespan_s), 100.0 * outcome.efficiency(cluster),
      test::bound_of(outcome, job, cluster), share(outcome.asking_s), share(outcome.moving_s),
      share(outcome.starting_s), share(outcome.lost_s + outcome.slow_s), share(outcome.idle_s),
      outcome.operations(), 100.0 * outcome.look_operations / outcome.operations(),
      outcome.num_lost);
  std::fflush(stdout);
}

/// Efficiency against workers, a curve for each scenario.
class Figure {
 public:
  Figure(const std::string& title, int most_workers) : most_workers_(most_workers) {
    text_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
        "height=\"{1}\" font-family=\"Helvetica,Arial,sans-serif\">\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"#fbfaf7\"/>\n",
        kWidth, kHeight);
    write(kLeft, 30, "start", 16, "#23303b", title);
    for (int percent = 0; percent <= 100; percent += 20) {
      line(kLeft, y(0.01 * percent), kRight, y(0.01 * percent));
      write(kLeft - 10, y(0.01 * percent) + 4, "end", 12, "#3c4a57", fmt::format("{} %", percent));
    }
    for (int workers = 1; workers <= most_workers; workers *= 10) {
      line(x(workers), y(0.0), x(workers), y(1.0));
      std::string label = fmt::to_string(workers);
      if (workers >= 10000) label.insert(label.size() - 3, " ");
      write(x(workers), y(0.0) + 20, "middle", 12, "#3c4a57", label);
    }
    write(0.5 * (kLeft + kRight), y(0.0) + 42, "middle", 13, "#3c4a57", "workers (one core each)");
    write(kLeft, y(1.0) - 14, "start", 13, "#3c4a57",
          "efficiency: useful CPU time / (workers x makespan)");
  }

  void add(const Scenario& scenario, const std::vector<std::pair<int, double>>& points) {
    std::string path;
    for (const auto& [workers, efficiency] : points)
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x(workers), y(efficiency));
    text_ += fmt::format(
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2.2\" "
        "stroke-linejoin=\"round\"/>\n",
        path, scenario.color);
    for (const auto& [workers, efficiency] : points)
      text_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n",
                           x(workers), y(efficiency), scenario.color);
    labels_.push_back({y(points.back().second), scenario});
  }

  /// Labels stand beside the ends of their curves, moved apart where these meet.
  std::string svg() {
    std::stable_sort(labels_.begin(), labels_.end(),
                     [](const Label& a, const Label& b) { return a.y < b.y; });
    double lowest = 0.0;
    for (Label& label : labels_) lowest = label.y = std::max(label.y, lowest + kLabelHeight);
    double highest = y(0.0) + kLabelHeight;
    for (auto label = labels_.rbegin(); label != labels_.rend(); ++label)
      highest = label->y = std::min(label->y, highest - kLabelHeight);
    for (const Label& label : labels_)
      write(kRight + 12, label.y + 4, "start", 13, label.scenario.color, label.scenario.name);
    return text_ + "</svg>\n";
  }

 private:
  static constexpr double kWidth = 900.0;
  static constexpr double kHeight = 470.0;
  static constexpr double kLeft = 70.0;
  static constexpr double kRight = 640.0;
  static constexpr double kTop = 80.0;
  static constexpr double kBottom = 410.0;
  static constexpr double kLabelHeight = 18.0;
  struct Label {
    double y;
    Scenario scenario;
  };

  double x(int workers) const {
    return kLeft + (kRight - kLeft) * std::log10(workers) / std::log10(most_workers_);
  }
  static double y(double efficiency) { return kBottom + (kTop - kBottom) * efficiency; }
  void line(double x1, double y1, double x2, double y2) {
    text_ += fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"#d9d6cd\"/>\n", x1, y1,
                         x2, y2);
  }
  void write(double x, double y, const char* anchor, int size, const std::string& color,
             const std::string& words) {
    text_ += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" font-size=\"{}\" "
        "fill=\"{}\">{}</text>\n",
        x, y, anchor, size, color, words);
  }

  int most_workers_;
  std::string text_;
  std::vector<Label> labels_;
};

SimulatedOutcome play(const SimulatedJob& job, SimulatedCluster cluster, int num_workers) {
  cluster.num_workers = num_workers;
  const SimulatedOutcome outcome = test::simulate(job, cluster);
  print_row(outcome, job, cluster);
  return outcome;
}

/// A batch that was run, each of its shards with its own wall time and nothing else.
SimulatedJob replayed(const batch::Plan& plan, const std::filesystem::path& folder) {
  SimulatedJob job = test::job_of(plan);
  const auto times = test::measured_times(plan, folder, true);
  for (std::size_t s = 0; s < times.size(); ++s)
    for (std::size_t i = 0; i < times[s].size(); ++i) job.stages[s][i].cpu_s = times[s][i];
  return job;
}

void run(int argc, char** argv) {
  CLI::App app("Plays a batch on clusters, with what shards were measured to cost.");
  std::filesystem::path measured_folder, plan_folder, figure_file;
  std::vector<int> workers = {1, 3, 10, 30, 100, 300, 1000, 3000, 10000};
  SimulatedCluster cluster{.start_s = 0.7, .start_operations = 480.0};
  double mtbf_h = test::kUnlimited;
  double operation_ms = 0.0;
  double task_min = 30.0;
  bool is_replay = false;
  bool is_without_merge = false;
  const std::map<std::string, test::Dealing> dealings = {
      {"pool", test::Dealing::Pool},
      {"pool-from-first", test::Dealing::PoolFromFirst},
      {"arrays", test::Dealing::Arrays}};
  app.add_option("MEASURED", measured_folder, "A batch that was run.")->required();
  app.add_option("--plan", plan_folder, "A batch that was planned; left out: MEASURED.");
  app.add_option("--figure", figure_file,
                 "Play the scenarios of docs/cluster.md and draw this SVG.");
  app.add_flag("--replay", is_replay, "Play MEASURED with its own wall times.");
  app.add_flag("--no-merge", is_without_merge, "Leave the merge out.");
  app.add_option("--workers", workers, "How many, several with commas.")->delimiter(',');
  app.add_option("--dealing", cluster.dealing, "pool, pool-from-first or arrays.")
      ->transform(CLI::CheckedTransformer(dealings));
  app.add_option("--workers-per-node", cluster.workers_per_node);
  app.add_option("--task-minutes", task_min, "CPU time of a task of an array.");
  app.add_option("--start-s", cluster.start_s, "CPU time of a process before its first shard.");
  app.add_option("--start-operations", cluster.start_operations);
  app.add_option("--operations-per-s", cluster.operations_per_s, "Of the metadata server.");
  app.add_option("--operation-ms", operation_ms, "To and fro, of one operation.");
  app.add_option("--bytes-per-s", cluster.bytes_per_s, "Of the file system.");
  app.add_option("--node-bytes-per-s", cluster.node_bytes_per_s);
  app.add_option("--node-mtbf-h", mtbf_h, "Mean time between failures of a node.");
  app.add_option("--repair-s", cluster.repair_s);
  app.add_option("--slow-share", cluster.slow_share, "Of nodes that are slow.");
  app.add_option("--slow-factor", cluster.slow_factor, "Of their CPU times.");
  app.add_option("--lease-s", cluster.lease_s);
  app.add_option("--max-tries", cluster.max_tries);
  app.add_option("--seed", cluster.seed);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error));
  }
  cluster.node_mtbf_s = 3600.0 * mtbf_h;
  cluster.operation_s = 1e-3 * operation_ms;
  cluster.task_s = 60.0 * task_min;

  if (plan_folder.empty()) plan_folder = measured_folder;
  const batch::Plan plan = batch::read_plan(plan_folder);
  // Every process reads the plan.
  for (const auto& entry : std::filesystem::recursive_directory_iterator(plan_folder / "plan"))
    if (entry.is_regular_file()) cluster.start_bytes += static_cast<double>(entry.file_size());
  SimulatedJob job = is_replay ? replayed(batch::read_plan(measured_folder), measured_folder)
                               : test::job_of(plan, test::measure_job(measured_folder, false),
                                              kUses, cluster.seed);
  if (is_without_merge) job.stages.back().clear();
  double bytes = 0.0;
  double operations = 0.0;
  std::size_t num_shards = 0;
  for (std::size_t s = 0; s < job.stages.size(); ++s) {
    double stage_s = 0.0, longest_s = 0.0, stage_bytes = 0.0, stage_operations = 0.0;
    for (const test::SimulatedShard& shard : job.stages[s]) {
      stage_s += shard.cpu_s;
      longest_s = std::max(longest_s, shard.cpu_s);
      stage_bytes += shard.read_bytes + shard.written_bytes;
      stage_operations += shard.operations;
    }
    fmt::print(
        "{}: {} shards, CPU {}, longest {}, {:.3g} bytes read and written, {:.3g} operations\n",
        batch::stage_name(batch::kStages[s]), job.stages[s].size(), time_text(stage_s),
        time_text(longest_s), stage_bytes, stage_operations);
    bytes += stage_bytes;
    operations += stage_operations;
    num_shards += job.stages[s].size();
  }
  fmt::print("{} shards, {} frames: CPU {}, {:.3g} bytes, {:.3g} operations; longest chain {}\n\n",
             num_shards, plan.num_frames(), time_text(job.cpu_s()), bytes, operations,
             time_text(job.critical_path_s()));

  const auto begin = std::chrono::steady_clock::now();
  if (figure_file.empty()) {
    print_header();
    for (const int count : workers) play(job, cluster, count);
  } else {
    Figure figure(
        fmt::format("{} sequences, {:.0f} million frames, {} shards", plan.num_sequences(),
                    1e-6 * static_cast<double>(plan.num_frames()), num_shards),
        *std::max_element(workers.begin(), workers.end()));
    SimulatedJob unmerged = job;
    unmerged.stages.back().clear();
    for (const Scenario& scenario : scenarios(cluster)) {
      fmt::print("\n{}\n\n", scenario.name);
      print_header();
      std::vector<std::pair<int, double>> points;
      for (const int count : workers) {
        SimulatedCluster played = scenario.cluster;
        played.num_workers = count;
        points.emplace_back(
            count, play(scenario.has_merge ? job : unmerged, played, count).efficiency(played));
      }
      figure.add(scenario, points);
    }
    core::write_file(figure_file, figure.svg());
  }
  fmt::print(
      "\nplayed in {}\n",
      time_text(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc, argv);
    return 0;
  } catch (const core::Error& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 1;
  }
}
