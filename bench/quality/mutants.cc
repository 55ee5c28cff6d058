// This text follows `sim/engines/cxxrtl_driver.cc`. blysk_mutant selects the mutant of the next models. blysk_start is
// the number at which their counters begin. A macro BLYSK_COUNTERS before this text has BLYSK_COUNTER(register) for each
// counter.

extern "C" {

uint64_t blysk_mutant = 0, blysk_start = 0;

void *blysk_open_mutant() {
	Simulation *simulation = static_cast<Simulation *>(blysk_open());
	simulation->model.p_mutant.data[0] = blysk_mutant;
#define BLYSK_COUNTER(name) \
	simulation->model.name.curr.data[0] = simulation->model.name.next.data[0] = blysk_start & simulation->model.name.curr.top;
	BLYSK_COUNTERS
	return simulation;
}

} // extern "C"
