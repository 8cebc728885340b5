!> A scene and an observer that allocate nothing.
module frb_still_bodies
    use frb, only: wp, group_observer, group_scene
    implicit none
    private

    public :: even_torques, onlooker

    type, extends(group_scene) :: even_torques
    contains
        procedure :: torques
    end type even_torques

    type, extends(group_observer) :: onlooker
    contains
        procedure :: observe
    end type onlooker

contains

    pure subroutine torques(self, q, t, tau)
        class(even_torques), intent(in) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        tau = 0.01_wp
    end subroutine torques

    subroutine observe(self, step, t, m, q)
        class(onlooker), intent(inout) :: self
        integer, intent(in) :: step
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(in) :: m(:, :), q(:, :)
    end subroutine observe

end module frb_still_bodies
