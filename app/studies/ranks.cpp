#include <cstdlib>

#include "app/studies/shared_battery.h"

#ifdef KNUCKLE_MPI
#include <mpi.h>

#include <limits>
#include <stdexcept>
#endif

namespace knuckle::studies {

#ifdef KNUCKLE_MPI

Ranks::Ranks() {
  // Open MPI's and PMI's marks; a process that was started alone need not wait for MPI's daemon.
  if (std::getenv("OMPI_COMM_WORLD_SIZE") == nullptr && std::getenv("PMI_RANK") == nullptr &&
      std::getenv("PMIX_RANK") == nullptr)
    return;
  int threads = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &threads);  // only this thread will call it
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

Ranks::~Ranks() {
  int initialised = 0;
  MPI_Initialized(&initialised);
  if (initialised != 0) MPI_Finalize();
}

int Ranks::first_failed(bool failed) const {
  int own = failed ? rank_ : size_, first = own;
  if (size_ > 1) MPI_Allreduce(&own, &first, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  return first;
}

void Ranks::check_length(const std::string& text) const {
  if (size_ > 1 && text.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw std::length_error("rows of one rank are longer than MPI can count: use more ranks");
}

void Ranks::end_all(int code) const {
  MPI_Abort(MPI_COMM_WORLD, code);
  std::abort();
}

std::vector<std::string> Ranks::gather(const std::string& text) const {
  if (size_ == 1) return {text};
  const int length = static_cast<int>(text.size());
  std::vector<int> lengths(static_cast<std::size_t>(size_));
  MPI_Gather(&length, 1, MPI_INT, lengths.data(), 1, MPI_INT, 0, MPI_COMM_WORLD);
  std::vector<std::string> all;
  if (!first()) {
    MPI_Send(text.data(), length, MPI_CHAR, 0, 0, MPI_COMM_WORLD);
    return all;
  }
  all.push_back(text);
  for (int rank = 1; rank < size_; ++rank) {
    std::string other(static_cast<std::size_t>(lengths[static_cast<std::size_t>(rank)]), '\0');
    MPI_Recv(other.data(), static_cast<int>(other.size()), MPI_CHAR, rank, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    all.push_back(std::move(other));
  }
  return all;
}

#else

Ranks::Ranks() = default;
Ranks::~Ranks() = default;

int Ranks::first_failed(bool failed) const {
  return failed ? 0 : 1;
}

void Ranks::check_length(const std::string&) const {}

void Ranks::end_all(int code) const {
  std::exit(code);
}

std::vector<std::string> Ranks::gather(const std::string& text) const {
  return {text};
}

#endif

}  // namespace knuckle::studies
