#include "app/bringup/commission_dialogue.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>

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
    if (count > 0) pending_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

void Dialogue::say(const std::string& line) {
  out_ << line << '\n' << std::flush;
}

void Dialogue::begin(int number, const std::string& title) {
  say("\n" + std::to_string(number) + ". " + title);
  if (input_.began) input_.began(number, title);
}

std::string Dialogue::answer(Question question) {
  while (interrupted()) {
  }
  if (input_.asked) input_.asked(question);
  out_ << "> " << std::flush;
  for (;;) {
    if (auto line = input_.poll()) return *line;
    idle_();
  }
}

int Dialogue::ask(const std::string& question, std::initializer_list<const char*> words) {
  std::string all;
  for (const char* word : words) all += (all.empty() ? "" : " | ") + std::string(word);
  out_ << question << " [" << all << "]\n";
  const std::string typed = answer({question, {words.begin(), words.end()}, {}});
  int index = 0;
  for (const char* word : words) {
    if (typed == word) return index;
    ++index;
  }
  throw CommissionEnded("'" + typed + "' is not " + all);
}

double Dialogue::ask_number(const std::string& question, double low, double high, std::optional<double> known) {
  const std::string bounds = number_text(low) + " to " + number_text(high);
  out_ << question << " [" << bounds << (known ? " | tape" : "") << "]\n";
  Question asked{question, {}, std::pair(low, high)};
  if (known) asked.words.emplace_back("tape");
  const std::string typed = answer(std::move(asked));
  if (known && typed == "tape") return *known;
  double value = 0;
  const auto end = std::from_chars(typed.data(), typed.data() + typed.size(), value);
  const bool number = end.ec == std::errc() && end.ptr == typed.data() + typed.size();
  if (!number || !(value >= low && value <= high)) {
    throw CommissionEnded("'" + typed + "' is no number from " + bounds);
  }
  return value;
}

bool Dialogue::interrupted() {
  return input_.live && input_.poll().has_value();
}

}  // namespace knuckle::bringup
