"""Knowledge of a team after training."""

from pitchlore.pipeline.stages.paradigms.runner import dynamics_of, learner_of, stream, trained


def learn(game, settings, training, *, run, seeds):
    """Memory of a team after one run's training, the same that ``play`` tests."""
    memory, _ = trained(
        stream(seeds, run), dynamics_of(game, settings), learner_of(settings, game.agents), settings, training)
    return memory
