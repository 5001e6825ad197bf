#include "app/bringup/commission_dialogue.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <thread>

#include "core/error.h"
#include "core/text.h"
#include "machine/toml_reader.h"

namespace knuckle::bringup {

std::optional<std::string> LineInput::poll() {
  for (;;) {
    if (const auto end = pending_.find('\n'); end != std::string::npos) {
      std::string line = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      return line;
    }
    if (ended_) throw CommissionEnded("the input has ended");
    pollfd ready{descriptor_, POLLIN, 0};
    if (::poll(&ready, 1, 0) <= 0) return std::nullopt;
    std::array<char, 256> bytes{};
    const ssize_t count = read(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) return std::nullopt;
    if (count <= 0) ended_ = true;
    // The last line of a file may lack its end. Of a pipe or a terminal, it may be half an answer.
    struct stat input;
    const bool file = fstat(descriptor_, &input) == 0 && S_ISREG(input.st_mode);
    if (count == 0 && file && !pending_.empty()) pending_ += '\n';
    if (count > 0) pending_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

std::string text(const Question& question) {
  std::vector<std::string> answers = question.choices;
  if (const auto& bounds = question.bounds)
    answers.insert(answers.begin(), number_text(bounds->first) + " to " + number_text(bounds->second));
  const std::string unit = question.unit.empty() ? "" : ", in " + question.unit + ":";
  return fmt::format("{}{} [{}]", question.text, unit, fmt::join(answers, " | "));
}

void check_told(const cli::BackgroundWriter& said, Duration patience) {
  constexpr std::chrono::milliseconds kLookAgain{1};
  const auto until = std::chrono::steady_clock::now() + patience;
  while (!said.idle() && said.refusal() == 0 && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(kLookAgain);
  if (const int error = said.refusal(); error != 0)
    throw InputError(std::string("standard output: cannot be written: ") + std::strerror(error) +
                     ": nobody would read what is asked; ended, machine neutral");
}

Partner terminal(std::ostream& out, std::function<std::optional<std::string>()> poll, bool live) {
  Partner partner;
  partner.say = [&out](const std::string& line) { out << printable_lines(line) << '\n' << std::flush; };
  partner.begin = [&out](int number, const std::string& title) {
    out << '\n' << number << ". " << title << '\n' << std::flush;
  };
  partner.ask = [&out](const Question& question) { out << text(question) << "\n> " << std::flush; };
  partner.poll = std::move(poll);
  partner.live = live;
  if (!live) partner.stop_gesture = "Ctrl+C";
  return partner;
}

std::string Dialogue::answer(const Question& question) {
  while (interrupted()) {
  }
  partner_.ask(question);
  for (;;) {
    if (auto line = partner_.poll()) return *line;
    idle_();
  }
}

int Dialogue::ask(const std::string& question, std::initializer_list<const char*> choices) {
  const Question asked{question, {choices.begin(), choices.end()}, {}, ""};
  for (;;) {
    const std::string typed = answer(asked);
    const auto found = std::find(asked.choices.begin(), asked.choices.end(), typed);
    if (found != asked.choices.end()) return static_cast<int>(found - asked.choices.begin());
    refuse(fmt::format("the answer '{}' is not one of {}", printable(typed), fmt::join(asked.choices, " | ")));
  }
}

double Dialogue::ask_number(const std::string& question, double low, double high, const std::string& unit,
                            std::optional<double> known) {
  Question asked{question, {}, std::pair(low, high), unit};
  if (known) asked.choices.emplace_back("tape");
  for (;;) {
    const std::string typed = answer(asked);
    if (known && typed == "tape") return *known;
    double value = 0;
    const auto end = std::from_chars(typed.data(), typed.data() + typed.size(), value);
    const bool number = end.ec == std::errc() && end.ptr == typed.data() + typed.size();
    if (number && value >= low && value <= high) return value;
    refuse("the answer '" + printable(typed) + "' is not a number from " + number_text(low) + " to " +
           number_text(high));
  }
}

/// A script that goes wrong once is wrong from there on. A person mistypes.
void Dialogue::refuse(const std::string& why) {
  if (!partner_.live) throw CommissionEnded(why);
  say(why + ": nothing moves; once more");
}

bool Dialogue::interrupted() {
  return partner_.live && partner_.poll().has_value();
}

}  // namespace knuckle::bringup
