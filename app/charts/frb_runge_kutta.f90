!> Rivals: the classical Runge-Kutta method, and the adaptive 8(5,3) of Dormand and Prince.
module frb_runge_kutta
    use frb_kinds, only: rk => wp
    implicit none
    private

    public :: rk4_steps, dormand_prince

    ! fpm does not see changes of included files: remove build/ after one.
    include 'rivals/runge_kutta.inc'

    include 'rivals/dormand_prince.inc'

end module frb_runge_kutta
