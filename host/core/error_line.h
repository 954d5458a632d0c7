// The one writer of stderr: whole lines, and a bar under them that makes way. Safe from any thread.
#pragma once
#include <cstddef>
#include <string_view>

namespace mote {

/// Writes `text` and a line break in one piece. A bar that stands there is wiped first.
void writeErrorLine(std::string_view text);

/// Where the lines go instead of to file descriptor 2.
void writeErrorLinesTo(int descriptor);

/// Whether a bar can be drawn: stderr is a terminal that knows how to wipe a line.
bool barsAreDrawn();
/// How many columns a bar may have: one that wraps cannot be wiped.
std::size_t barColumns();
/// Draws `text` (ASCII) over the bar before, cut to barColumns().
void drawBar(std::string_view text);
/// Takes the bar away, if there is one.
void wipeBar();

}  // namespace mote
