!> A scene and an observer that allocate nothing.
module frb_still_bodies
    use, intrinsic :: iso_fortran_env, only: int64
    use frb, only: wp, group_observer, group_scene, status_ok
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

    subroutine torques(self, q, t, tau, stat)
        class(even_torques), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        integer, intent(out) :: stat

        tau = 0.01_wp
        stat = status_ok
    end subroutine torques

    subroutine observe(self, step, t, m, q, stop)
        class(onlooker), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(in) :: m(:, :), q(:, :)
        logical, intent(inout) :: stop
    end subroutine observe

end module frb_still_bodies
