// Commissioning and identification of the simulated machine as a job of its own thread, with what a screen shows of it:
// the very wizard of `knuckle commission` and the very pipeline of `knuckle identify --simulate`, answered by buttons.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/bringup/commission_dialogue.h"
#include "core/joints.h"
#include "core/mailbox.h"
#include "machine/description.h"

namespace knuckle::console {

struct CalibrationPlan {
  std::string machine = "solar015";  ///< Name in config/machines or path of a .toml file.
  std::string target;                ///< Calibrated machine file to write on acceptance; a link stays a link.
  std::uint64_t seed = 1;            ///< Draws the simulated machine's truth.
  double slow_s = 120, fast_s = 80;  ///< Of the motions driven.
  double pace = 8;  ///< Simulated seconds in one while the wizard moves something; 0: as fast as it can.
};

enum class CalibrationStage : std::uint8_t {
  kIdentity,
  kNodes,
  kMotionEnable,
  kSigns,
  kStrokes,
  kDeadBands,
  kPoses,
  kDynamics,
  kHoldOut,
  kDecision,  ///< Waits for accept() or discard().
  kOver,      ///< outcome says how.
};
inline constexpr int kCalibrationStages = 11;

/// What the held-out motion says, for the new calibration and for the one before it.
struct HoldOutRow {
  std::string recording;
  JointVector new_nrmse = JointVector::Zero();
  std::optional<JointVector> old_nrmse;  ///< nullopt: there was no calibration before.
};

/// A calibration that was accepted, with what it takes to take it back.
struct Acceptance {
  std::string file;     ///< The file itself, where the target is a link.
  std::string kept;     ///< Where the file before it is; empty: there was none.
  std::string content;  ///< As it was written.
};

struct CalibrationState {
  CalibrationStage stage = CalibrationStage::kIdentity;
  double done = 0;                            ///< Share of a stage that takes its time.
  std::vector<std::string> said;              ///< By the wizard, line by line.
  std::optional<bringup::Question> question;  ///< Waits for answer().
  std::vector<double> condition_numbers;      ///< After each surveyed pose, as soon as there are enough.
  std::size_t poses = 0;
  std::vector<HoldOutRow> hold_out;
  bool usable = false;
  std::string verdict;  ///< One line, once identified.
  std::string outcome;  ///< At the end, one line.
  std::optional<Acceptance> accepted;
};

class CalibrationJob {
 public:
  /// Starts at once. @throws InputError where the machine file cannot be used, or the target cannot be written or is
  /// something else than a machine file.
  explicit CalibrationJob(CalibrationPlan plan);
  /// Ends what is going on; the simulated machine is neutral then.
  ~CalibrationJob();
  CalibrationJob(const CalibrationJob&) = delete;
  CalibrationJob& operator=(const CalibrationJob&) = delete;

  /// One word or number for the question that waits; anything while something moves stops it.
  void answer(const std::string& word);
  void cancel();
  /// The result becomes the target file, whole or not at all; a file already there is kept. Only in kDecision.
  void accept();
  void discard();

  /// @param seen version of the state that the caller has. @return nullopt where nothing is new since.
  [[nodiscard]] std::optional<CalibrationState> newer(std::uint64_t& seen) const;
  /// Joints of the simulated machine while the wizard works with it.
  [[nodiscard]] const JointVector& pose_rad() noexcept {
    poses_.take(pose_rad_);
    return pose_rad_;
  }

 private:
  enum class Decision : std::uint8_t { kNone, kAccept, kDiscard };
  void run();
  void commission();
  [[nodiscard]] bringup::Partner screen();
  void identify_and_decide();
  [[nodiscard]] Decision wait_for_decision() const;
  void check() const;
  [[nodiscard]] std::optional<std::string> poll();
  template <typename Change>
  void change(Change change);

  CalibrationPlan plan_;
  std::string machine_file_;
  MachineDescription before_;  // as calibrated until now
  mutable std::mutex mutex_;   // of all below up to the thread: no real-time loop comes here
  CalibrationState state_;
  std::uint64_t version_ = 1;
  std::vector<std::string> answers_;
  Decision decision_ = Decision::kNone;
  std::atomic<bool> cancelled_{false};
  Mailbox<JointVector> poses_;
  JointVector pose_rad_ = JointVector::Zero();
  std::thread thread_;
};

/// Takes an acceptance back: the file kept takes its place again, or, where none was, the file goes.
/// What was accepted is kept beside it. @return where.
/// @throws InputError where that cannot be done, or the file is no longer what was accepted; it is as it was then.
std::string roll_back(const Acceptance& accepted);

}  // namespace knuckle::console
