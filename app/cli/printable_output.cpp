#include "app/cli/printable_output.h"

#include "core/text.h"

namespace knuckle::cli {

PrintableOutput::PrintableOutput(std::ostream& stream)
    : stream_(stream), destination_(stream.rdbuf()), buffer_([this](std::string_view text) {
        const std::string shown = printable_lines(text);
        const auto size = static_cast<std::streamsize>(shown.size());
        return destination_->sputn(shown.data(), size) == size && destination_->pubsync() == 0;
      }) {
  const std::ios::iostate state = stream_.rdstate();  // of one that was refused before, too
  stream_.rdbuf(&buffer_);
  stream_.clear(state);
}

PrintableOutput::~PrintableOutput() {
  stream_.flush();
  const std::ios::iostate state = stream_.rdstate();
  stream_.rdbuf(destination_);
  stream_.clear(state);
}

}  // namespace knuckle::cli
