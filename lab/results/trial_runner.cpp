#include "lab/results/trial_runner.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/results/output_folder.hpp"
#include "lab/results/trial_files.hpp"
#include "lab/results/trial_report.hpp"
#include "lab/session/virtual_session.hpp"
#include "proto/content_hash.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;
namespace fs = std::filesystem;

std::string hash_of(std::string_view text) {
  return proto::hex(proto::sha256_of(std::as_bytes(std::span(text.data(), text.size()))));
}

/// A scene and its fingerprint.
struct KeptScene {
  std::shared_ptr<const server::LoadedScene> scene;
  std::string fingerprint;  ///< hash of the scene file and of all files that it names
};

std::string fingerprint_of(const std::string& text, const server::LoadedScene& scene) {
  std::string all = hash_of(text);
  for (const server::Asset& asset : scene.assets) all += proto::hex(asset.sha256);
  return hash_of(all);
}

std::string text_of(const net::DelayPath& path) {
  std::ostringstream text;
  text << path.starts_anywhere;
  for (const net::DelayPath::Point& point : path.points) text << ' ' << point.at.count() << ' ' << point.delay.count();
  return text.str();
}

/// Returns the content of all hand paths, device profiles and delay paths. It is hashed into the trial's key
/// (key_of()), so a change of any of these files gives a new key.
std::string files_text(const Experiment& experiment, const fs::path& directory) {
  std::string text;
  std::vector<devices::DeviceProfile> devices;
  for (const ExperimentUser& user : experiment.users) {
    const bool is_file = fs::path(user.hand_name).extension() == ".json";
    text += is_file ? read_text_file(directory / user.hand_name) : user.hand_name;
    text += devices::device_profiles_text({user.device});
    text += text_of(user.up.delay_path) + text_of(user.down.delay_path);
  }
  return text;
}

/// Returns the key of a trial: the hash of everything that determines its result.
std::string key_of(const Trial& trial, const KeptScene& scene, const std::string& program) {
  json::object document = experiment_json(trial.experiment);
  document.erase("description");
  document.erase("scene");
  return hash_of(compact_json(document) + scene.fingerprint + files_text(trial.experiment, trial.file.directory) +
                 program)
      .substr(0, 32);
}

std::string scene_key(const Experiment& experiment) {
  return experiment.scene.string() + "\n" + compact_json(experiment.scene_changes);
}

/// A run at zero delay to which several trials are compared. The thread of the first such trial performs the run. The
/// memory of the trace is released after the last of these trials.
struct SharedReference {
  Trial trial;
  std::size_t open = 0;  ///< number of unfinished trials that need this run
  std::mutex running;
  std::shared_ptr<const SessionTrace> trace;
};

struct Job {
  std::size_t trial = 0;
  const KeptScene* scene = nullptr;
  std::string key;
  SharedReference* reference = nullptr;
  SharedReference* same_stage = nullptr;  ///< often the same run as `reference`; null if not requested
};

// Converts a row to text and back. A reused result is read from a file, where 2.0 may have become the integer 2. After
// this conversion, new results have the same number types and give the same output files.
json::object as_read_back(const json::object& row) {
  return parse_json(pretty_json(row), "a trial's row").get_object();
}

std::optional<TrialResult> kept_result(const fs::path& file, const std::string& key) {
  if (!fs::is_regular_file(file)) return std::nullopt;
  try {
    const json::value value = parse_json(read_text_file(file), file.string());
    JsonFields fields(value, file.string());
    TrialResult result;
    result.key = fields.required_text("key");
    result.virtual_s = fields.required_number("virtual_s", 0, 1e9);
    result.wall_s = fields.required_number("wall_s", 0, 1e9);
    result.row = value.as_object().at("row").as_object();
    result.was_done = true;
    if (result.key == key) return result;
  } catch (const std::exception&) {
    return std::nullopt;  // another program wrote the result, or the file is damaged: the trial runs again
  }
  return std::nullopt;
}

void keep_result(const fs::path& file, const TrialResult& result) {
  const json::object kept{
      {"key", result.key}, {"virtual_s", result.virtual_s}, {"wall_s", result.wall_s}, {"row", result.row}};
  const fs::path unfinished = file.string() + ".unfinished";
  write_text_file(unfinished, pretty_json(kept));
  fs::rename(unfinished, file);
}

/// Returns the row of a trial that a user could not join. The row contains no measurements.
json::object row_without_trace(const Trial& trial, const std::string& why) {
  SessionTrace nothing;
  for (const ExperimentUser& user : trial.experiment.users) nothing.users.emplace_back().user = user;
  json::object row = trial_row(trial, {trial.experiment, nothing});
  for (const TrialMetric& metric : trial_metrics()) row[metric.name] = nullptr;
  row["outcome"] = "not-joined";
  row["why"] = why;
  return row;
}

}  // namespace

struct TrialRunner::Impl {
  Impl(std::vector<Trial> its_trials, RunSettings its_settings, const server::SceneLoading& loading);

  void load_scenes(const server::SceneLoading& loading);
  void make_jobs();
  SharedReference& shared(Trial at_zero_delay, const KeptScene& scene);
  fs::path file_of(const Job& job) const { return settings.out / "trials" / (job.key + ".json"); }
  fs::path samples_of(const Job& job) const;
  std::optional<TrialResult> kept(const Job& job) const;
  void work();
  void do_job(const Job& job);
  TrialResult run_job(const Job& job);
  std::shared_ptr<const SessionTrace> reference_trace(SharedReference* reference, const KeptScene& scene);
  void forget_if_last(SharedReference* reference);
  void note_done(const Job& job, TrialResult result);

  std::vector<Trial> trials;
  RunSettings settings;
  std::map<std::string, KeptScene> scenes;
  std::map<std::string, std::unique_ptr<SharedReference>> references;
  std::vector<Job> jobs;  ///< jobs with the same reference are adjacent
  std::atomic<std::size_t> next_job{0};
  std::atomic<bool> has_failed{false};

  std::mutex mutex;  ///< protects all following members
  std::vector<TrialResult> results;
  std::exception_ptr failure;
  std::size_t done = 0;
  std::size_t reused = 0;
  std::function<void(std::size_t, std::size_t)> on_progress;
  SteadyClock wall;
};

TrialRunner::Impl::Impl(std::vector<Trial> its_trials, RunSettings its_settings, const server::SceneLoading& loading)
    : trials(std::move(its_trials)), settings(std::move(its_settings)) {
  load_scenes(loading);
  make_jobs();
  results.resize(trials.size());
}

void TrialRunner::Impl::load_scenes(const server::SceneLoading& loading) {
  for (const Trial& trial : trials) {
    KeptScene& kept = scenes[scene_key(trial.experiment)];
    if (kept.scene == nullptr) {
      kept.scene = load_experiment_scene(trial.experiment, loading);
      kept.fingerprint = fingerprint_of(scene_text(trial.experiment), *kept.scene);
    }
    check_manipulators(trial.experiment, *kept.scene);
  }
}

SharedReference& TrialRunner::Impl::shared(Trial at_zero_delay, const KeptScene& scene) {
  auto& place = references[key_of(at_zero_delay, scene, settings.program)];
  if (place == nullptr) {
    place = std::make_unique<SharedReference>();
    place->trial = std::move(at_zero_delay);
  }
  return *place;
}

void TrialRunner::Impl::make_jobs() {
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const KeptScene& scene = scenes.at(scene_key(trials[i].experiment));
    SharedReference& reference = shared(reference_of(trials[i]), scene);
    SharedReference* same_stage = settings.holds_against_own_stage ? &shared(same_stage_of(trials[i]), scene) : nullptr;
    const std::string baseline = settings.holds_against_own_stage ? "" : "against the truth alone";
    jobs.push_back({i, &scene, key_of(trials[i], scene, settings.program + baseline), &reference, same_stage});
    if (kept(jobs.back())) continue;
    ++reference.open;
    if (same_stage != nullptr) ++same_stage->open;
  }
  std::map<const SharedReference*, std::size_t> first;
  for (const Job& job : jobs) first.emplace(job.reference, job.trial);
  std::stable_sort(jobs.begin(), jobs.end(),
                   [&](const Job& a, const Job& b) { return first.at(a.reference) < first.at(b.reference); });
}

fs::path TrialRunner::Impl::samples_of(const Job& job) const {
  return settings.samples_lie_in_out ? settings.out : settings.out / "samples" / job.key;
}

std::optional<TrialResult> TrialRunner::Impl::kept(const Job& job) const {
  if (settings.keeps_samples && !has_trial_files(samples_of(job), job.key)) return std::nullopt;
  return kept_result(file_of(job), job.key);
}

std::shared_ptr<const SessionTrace> TrialRunner::Impl::reference_trace(SharedReference* reference,
                                                                       const KeptScene& scene) {
  if (reference == nullptr) return nullptr;
  const std::lock_guard lock(reference->running);
  if (reference->trace == nullptr) {
    reference->trace =
        std::make_shared<const SessionTrace>(run_virtual_session(reference->trial.experiment, scene.scene));
  }
  return reference->trace;
}

void TrialRunner::Impl::forget_if_last(SharedReference* reference) {
  if (reference == nullptr) return;
  const std::lock_guard lock(reference->running);
  if (--reference->open == 0) reference->trace.reset();
}

TrialResult TrialRunner::Impl::run_job(const Job& job) {
  const Trial& trial = trials[job.trial];
  TrialResult result;
  result.key = job.key;
  std::optional<TrialFiles> files;
  OnTick on_tick;
  if (settings.keeps_samples) {
    files.emplace(trial.experiment, samples_of(job));
    on_tick = [&](std::size_t user, const client::TickRecord& record, int phase) {
      files->write_tick(user, record, phase);
    };
  }
  const LocalTime from = wall.now();
  try {
    const auto reference = reference_trace(job.reference, *job.scene);
    const auto same_stage = reference_trace(job.same_stage, *job.scene);
    const SessionTrace trace = run_virtual_session(trial.experiment, job.scene->scene, on_tick);
    result.virtual_s = to_seconds(trace.joined_after + trial.experiment.duration);
    result.row = as_read_back(trial_row(trial, {trial.experiment, trace, reference.get(), same_stage.get()}));
    if (files) files->finish(trace, job.key, trial_report(trial.experiment, trace, reference.get()));
  } catch (const CouldNotJoin& error) {
    result.row = as_read_back(row_without_trace(trial, error.what()));
  }
  result.wall_s = to_seconds(wall.now() - from);
  return result;
}

void TrialRunner::Impl::note_done(const Job& job, TrialResult result) {
  if (settings.keeps_samples && has_trial_files(samples_of(job), job.key)) result.samples = samples_of(job);
  const std::lock_guard lock(mutex);
  ++done;
  reused += result.was_done ? 1 : 0;
  results[job.trial] = std::move(result);
  if (on_progress) on_progress(done, reused);
}

void TrialRunner::Impl::do_job(const Job& job) {
  if (auto stored = kept(job)) {
    note_done(job, std::move(*stored));
    return;
  }
  TrialResult result = run_job(job);
  forget_if_last(job.reference);
  forget_if_last(job.same_stage);
  keep_result(file_of(job), result);
  note_done(job, std::move(result));
}

void TrialRunner::Impl::work() {
  while (!has_failed) {
    const std::size_t index = next_job++;
    if (index >= jobs.size()) return;
    try {
      do_job(jobs[index]);
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      has_failed = true;
    }
  }
}

TrialRunner::TrialRunner(std::vector<Trial> trials, RunSettings settings, const server::SceneLoading& loading)
    : impl_(std::make_unique<Impl>(std::move(trials), std::move(settings), loading)) {}

TrialRunner::~TrialRunner() = default;

StudySize TrialRunner::size() const {
  StudySize size;
  size.trials = impl_->trials.size();
  for (const Job& job : impl_->jobs) {
    if (impl_->kept(job)) {
      ++size.done;
    } else {
      size.virtual_s += to_seconds(impl_->trials[job.trial].experiment.duration);
    }
  }
  for (const auto& [key, reference] : impl_->references) {
    if (reference->open == 0) continue;
    ++size.references;
    size.virtual_s += to_seconds(reference->trial.experiment.duration);
  }
  return size;
}

std::vector<TrialResult> TrialRunner::run(const std::function<void(std::size_t, std::size_t)>& on_progress) {
  made_folder((impl_->settings.out / "trials").string());
  impl_->on_progress = on_progress;
  std::vector<std::jthread> threads;
  for (std::size_t i = 1; i < impl_->settings.threads; ++i) threads.emplace_back([this] { impl_->work(); });
  impl_->work();
  threads.clear();  // waits for the threads to end
  if (impl_->failure) std::rethrow_exception(impl_->failure);
  return std::move(impl_->results);
}

std::string program_fingerprint() {
  std::ifstream program("/proc/self/exe", std::ios::binary);
  std::ostringstream bytes;
  bytes << program.rdbuf();
  if (!program) throw std::runtime_error("/proc/self/exe: this program's own file cannot be read");
  return hash_of(std::move(bytes).str());
}

}  // namespace tandem::lab
