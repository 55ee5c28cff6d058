// Behind `sim/engines/cxxrtl_driver.cc`: which mutant the next models are.

extern "C" {

uint64_t blysk_mutant = 0;

void *blysk_open_mutant() {
	Simulation *simulation = static_cast<Simulation *>(blysk_open());
	simulation->model.p_mutant.data[0] = blysk_mutant;
	return simulation;
}

} // extern "C"
