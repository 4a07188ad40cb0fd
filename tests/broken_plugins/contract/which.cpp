// The one thing that the plugins of a kind differ in.
extern "C" {
extern const char vantage_broken_clause[];
extern const char vantage_broken_name[];
const char vantage_broken_clause[] = BREAKS;
const char vantage_broken_name[] = "breaks_" BREAKS;
}
