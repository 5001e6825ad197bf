// `knuckle replay`: runs the loops of a recording again and says where they do otherwise; with --with, --control and
// --contact-model, with something else in their place.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "core/joints.h"
#include "machine/contact_model.h"
#include "recording/replay.h"
#include "slave/slave_state.h"

namespace knuckle::replay {

struct Changes {
  std::vector<std::string> with;  ///< Machines or devices, names or files; a file says which it is by its keys.
  std::string control;            ///< Bilateral law; empty: the recorded one.
  std::string contact_model;      ///< Likewise.
  [[nodiscard]] bool any() const noexcept { return !with.empty() || !control.empty() || !contact_model.empty(); }
};

/// @throws InputError naming the option.
void change(recording::ReplaySetup& setup, const Changes& changes);

[[nodiscard]] cli::Command replay_entry();

// The forces of one recording by the contact model that ran and by another in its place: how often each answers, how
// far the two are apart, and how far each is off the true force where a table of the simulated session tells it.

class ForceComparison {
 public:
  /// Of the true force, above which something touches the bucket.
  static constexpr double kTouching_N = 1;

  /// @param session_table what `knuckle simulate --csv` wrote of the recorded session; empty: no true force is known.
  /// @throws InputError where it cannot be read or lacks a column.
  ForceComparison(ContactModel recorded, ContactModel replayed, const std::string& session_table);

  /// A step of the machine's side; one in which not every sensor had been heard counts for nothing.
  /// @throws InputError where the table tells another force of it than was recorded: it is of another session.
  void add(const slave::SlaveState& recorded, const slave::SlaveState& replayed);

  /// The comparison in lines; empty where no step counts. @throws InputError where the table has no such step.
  [[nodiscard]] std::string text() const;

 private:
  struct Model {
    ContactModel model;
    std::uint64_t answered = 0;            ///< Steps.
    std::vector<double> off_N{};           ///< From the true force, where it answered, ...
    std::vector<double> off_touching_N{};  ///< ... and where something touches besides.
  };
  /// A row of the table.
  struct Row {
    PlanarVector true_N, estimated_N;
  };
  void read(const std::string& session_table);

  std::string table_;
  std::map<std::int64_t, Row> rows_;  ///< By time, in units of kTimeUnit_s.
  std::array<Model, 2> models_;       ///< Recorded, replayed.
  std::uint64_t steps_ = 0;
  std::vector<double> apart_N_;  ///< Where both answered.
};

}  // namespace knuckle::replay
