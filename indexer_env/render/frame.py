"""The door to the drawing: a scene becomes pixels or a window, and a missing pygame one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from indexer_env.checks import check_integer, check_number
from indexer_env.render.scene import Scene

if TYPE_CHECKING:
    import pygame

    from indexer_env.diagnosis_task import Setting

SMALLEST = (480, 360)
"""Width and height below which words would touch [px]."""


def draw(scene: Scene, width: int = 640, height: int = 480) -> np.ndarray:
    """A scene as pixels; opens no window and needs no screen.

    Returns
    -------
    ndarray (height, width, 3) of uint8
        Red, green, blue; a new array, the same for the same scene.

    Raises
    ------
    ParameterError
        A picture smaller than 480 × 360.
    gymnasium.error.DependencyNotInstalled
        pygame is not installed.
    """
    return _pixels(_surface(scene, width, height))


def draw_spectra(
    turns: Sequence[tuple[Setting, np.ndarray]], left: float, width: int = 640, height: int = 480
) -> np.ndarray:
    """What the turns of a diagnosis have shown, each a setting and its spectrum (BANDS,) in [-1, 1], and the share
    `left` of the budget, as pixels; returns and raises as `draw`."""
    _check_size("draw_spectra", width, height)
    _need_pygame()
    from indexer_env.render.spectra_view import paint_spectra

    return _pixels(paint_spectra(turns, left, width, height).finished())


def _pixels(surface: pygame.Surface) -> np.ndarray:
    import pygame

    pixels = np.frombuffer(pygame.image.tobytes(surface, "RGB"), dtype=np.uint8)
    return pixels.reshape(surface.get_height(), surface.get_width(), 3).copy()


class Window:
    """Scenes on the screen, one after the other, as Gymnasium's render mode "human" shows them.

    The window opens with the first scene, also after `close`. pygame has one window per process. Without a screen, set
    SDL_VIDEODRIVER=dummy.

    Parameters
    ----------
    width, height : int
        Size [px], at least 480 × 360.
    render_fps : float
        Most scenes shown per second; `show` waits so long [Hz], > 0.
    title : str
        Of the window.
    """

    def __init__(self, width: int = 640, height: int = 480, render_fps: float = 30.0, title: str = "Indexer") -> None:
        _check_size("Window", width, height)
        check_number("Window", "render_fps", render_fps, low=0.0, low_open=True, unit="Hz")
        self._width, self._height, self._fps, self._title = width, height, render_fps, title
        self._screen: pygame.Surface | None = None
        self._clock: pygame.time.Clock | None = None

    @property
    def is_open(self) -> bool:
        """Whether `show` has opened the window and `close` has not closed it since."""
        return self._screen is not None

    def show(self, scene: Scene) -> None:
        """Show a scene, answer the window manager and wait for the next frame's time.

        Raises
        ------
        gymnasium.error.DependencyNotInstalled
            pygame is not installed.
        """
        picture = _surface(scene, self._width, self._height)
        import pygame

        # whoever else uses pygame may have shut it down for all
        if self._screen is None or self._clock is None or not pygame.display.get_init():
            pygame.display.init()
            self._screen = pygame.display.set_mode((self._width, self._height))
            pygame.display.set_caption(self._title)
            self._clock = pygame.time.Clock()
        self._screen.blit(picture, (0, 0))
        pygame.event.pump()
        self._clock.tick(self._fps)
        pygame.display.flip()

    def close(self) -> None:
        """Take the window from the screen; a second call does nothing."""
        if self._screen is not None:
            import pygame

            pygame.display.quit()
            self._screen = self._clock = None


def _check_size(owner: str, width: int, height: int) -> None:
    check_integer(owner, "width", width, low=SMALLEST[0], unit="px")
    check_integer(owner, "height", height, low=SMALLEST[1], unit="px")


def _surface(scene: Scene, width: int, height: int) -> pygame.Surface:
    _check_size("draw", width, height)
    _need_pygame()
    from indexer_env.render.picture import paint

    return paint(scene, width, height).finished()


def _need_pygame() -> None:
    # Gymnasium before pygame: it keeps pygame from printing its greeting
    from gymnasium.error import DependencyNotInstalled

    try:
        import pygame  # noqa: F401
    except ImportError as error:
        raise DependencyNotInstalled(
            'pygame is not installed, run `pip install "indexer-diagnosis[render]"`'
        ) from error
