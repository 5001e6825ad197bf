// Processes that share one piece of work: those that mpirun started, or this one alone. Built with MPI only where
// CMake's option KNUCKLE_MPI is on; without it, or without mpirun, there is one rank.
#pragma once

#include <string>
#include <vector>

namespace knuckle::studies {

class Ranks {
 public:
  /// Joins the others, where mpirun (or srun) has started this process.
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  [[nodiscard]] int rank() const noexcept { return rank_; }
  [[nodiscard]] int size() const noexcept { return size_; }
  [[nodiscard]] bool first() const noexcept { return rank_ == 0; }
  /// Waits for all. @return the first of those that have failed; size() where none has.
  [[nodiscard]] int first_failed(bool failed) const;
  /// @throws std::length_error where gather() could not take so much.
  void check_length(const std::string& text) const;
  /// Ends all processes with this exit code: one has failed while the others are at work.
  [[noreturn]] void end_all(int code) const;
  /// Waits for all. @return on the first rank what each has given, by rank; elsewhere nothing.
  [[nodiscard]] std::vector<std::string> gather(const std::string& text) const;

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace knuckle::studies
